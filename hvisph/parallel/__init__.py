"""Several processes: what they say to each other, which particles each has, and the rows that they show each other."""
