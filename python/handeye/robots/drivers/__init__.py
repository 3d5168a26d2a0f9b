"""Drivers of real arms: a file each, found by entry point, their libraries imported when opened.

None of them has been tried on a real arm; what each was tested against is on its page in docs.
"""
