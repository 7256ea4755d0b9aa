"""What goes wrong in the world: faults of sensors and wheels, and kidnappings."""
