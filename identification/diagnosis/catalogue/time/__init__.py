"""Effects of time itself: what comes late, and clocks that disagree."""
