"""Pictures and pages for people; the only folder that imports matplotlib."""
