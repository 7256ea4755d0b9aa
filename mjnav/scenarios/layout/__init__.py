"""Random scenes: what a run file draws from ranges, and what a layout has to keep to."""
