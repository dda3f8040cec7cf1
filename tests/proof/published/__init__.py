"""Published identification protocols, one file a recording, run as they are stated."""
