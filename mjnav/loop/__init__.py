"""The closed loop: one tick, the episode around it, and the clock beside it."""
