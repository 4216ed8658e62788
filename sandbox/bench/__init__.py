"""Every promised speed, measured as a ratio in one run (`sandbox bench`)."""
