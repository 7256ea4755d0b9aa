"""What one decision is made of: candidates, costs, constraints, the nominal control and what is desired."""
