"""Effects within a sensor."""
