"""How well models of prediction foretell where people go: over a log, a scene or a recording, without a controller."""
