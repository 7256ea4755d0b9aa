"""Sequential Monte Carlo primitives: arrays in, arrays out; the caller passes every generator."""
