"""Other ways to the same answers: libraries that need not be there, and programs that need a compiler."""
