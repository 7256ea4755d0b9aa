"""From the loop's records to the bytes of each topic."""
