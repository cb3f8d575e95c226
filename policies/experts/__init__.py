"""Those who know how: scripted experts, keyboard driving and recorded demonstrations."""
