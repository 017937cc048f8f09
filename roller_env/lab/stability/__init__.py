"""Where methods break: limits predicted and then found, failures with their cures, hard cases.

``scripts/stability.py`` runs all of `smooth`, `contacts`, `failures` and `hard_cases`; what people
read of a case is in the CSV file of its table.
"""
