"""A log read back, whole or cut off."""
