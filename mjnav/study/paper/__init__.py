"""What each figure of Nair et al. (arXiv 2112.13034) shows, measured again."""
