"""Configuration measures f(q) whose gradients enter the problem as a = alpha grad f."""
