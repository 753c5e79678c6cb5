"""Identity of whiskers that swing through one another."""
