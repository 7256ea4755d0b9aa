"""Predicted risks compared with how often they come true."""
