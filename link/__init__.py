"""The link between two stations: sealed datagrams, keys from a mutual TLS handshake, one operator's lease."""
