"""How people walk: one file a behaviour, and `pedestrians`, which asks them all."""
