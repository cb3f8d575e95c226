"""Navigate: a drone reaches a goal through forest at speed."""
