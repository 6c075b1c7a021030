"""What all reports share: the folder they are written to, the page, figures and numbers in it."""
