"""Drive: a rover reaches a pose on hills, or parks between walls and cars, past what moves."""
