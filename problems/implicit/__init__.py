"""N'W and N'a of a robot without W or grad f, for eq6_implicit (end of section III, English & Maciejewski)."""
