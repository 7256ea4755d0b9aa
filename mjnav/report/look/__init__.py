"""What all pages share: one style, light and dark, a policy that allows nothing but the page's own, definitions."""
