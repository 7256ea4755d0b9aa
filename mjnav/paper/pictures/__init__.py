"""The figures of Nair et al. (arXiv 2112.13034), drawn from what `mjnav.paper` measured."""
