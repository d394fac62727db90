"""C. Touzet (2000), "Robot Awareness in Cooperative Mobile Robot Learning": experiments, claims, figures and ledger."""
