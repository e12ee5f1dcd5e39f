"""What the two stations of a telemanipulation share: two arms each, their link, their simulated plant."""
