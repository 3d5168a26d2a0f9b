"""Drivers of real cameras: a file each, found by entry point, their libraries imported when opened.

None of them has been tried on a real camera; what each was tested against is on its page in docs.
"""
