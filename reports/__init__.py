"""Pages made from run folders: what was run, what came out, and every case behind it."""
