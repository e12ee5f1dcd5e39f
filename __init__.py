"""hapticd: a real-time daemon for kinesthetic haptic interfaces."""
