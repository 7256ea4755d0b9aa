"""The figures and claims of Nair et al. (arXiv 2112.13034), measured again: one file a figure.

A figure's file holds its claims, the study or the measurement that they are judged by, and the picture; `items` lists
them all, `page` puts what became of them on one page.
"""
