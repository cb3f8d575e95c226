"""What pages that stand alone share."""
