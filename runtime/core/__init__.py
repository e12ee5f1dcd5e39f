"""The tick: what is sensed, judged and commanded, free of clocks and of any kind of machine."""
