"""A search for inputs and moments that break something: ``python -m tests.campaign [--minutes N] [--seed S]``."""
