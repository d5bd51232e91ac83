"""Parameters: units and ranges declared once, errors of one line, files that a user names, presets."""
