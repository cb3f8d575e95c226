"""How well policies are judged without flying."""
