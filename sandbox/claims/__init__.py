"""The paper's claims, each computed: `table.py` lists them in the paper's order, `ledger.py` carries them out."""
