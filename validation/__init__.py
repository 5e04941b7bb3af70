"""Claims of atmos against the outside world: peers, published tables, measurements."""
