"""What communication is worth in forage, consume and graze: the claims of Balch and Arkin, checked against runs."""
