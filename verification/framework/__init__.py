"""What studies are made with: checks, cases, chapters, records, convergence, measuring."""
