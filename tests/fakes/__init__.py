"""Backends that misbehave, for the tests of the process that must survive them."""
