"""The page of a review: HTML, style and JavaScript, shipped with the package."""
