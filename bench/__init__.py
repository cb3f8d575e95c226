"""Speed and quality, measured: one script per question. `python -m bench [NAME…]` runs them."""
