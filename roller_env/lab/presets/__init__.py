"""Physics presets chosen by measurement: settings, what they get wrong, and what they cost."""
