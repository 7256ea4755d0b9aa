"""Which collisions and time-outs of many logs could have been avoided, method by method."""
