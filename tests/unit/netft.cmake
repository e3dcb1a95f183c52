# hal/netft against its emulated peer.
