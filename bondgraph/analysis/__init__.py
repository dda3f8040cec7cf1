"""Linear systems, structural ranks, redundancy relations."""
