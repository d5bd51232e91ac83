"""Parameters: units and ranges declared once, one-line errors, user files, presets, conventions."""
