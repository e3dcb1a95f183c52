# hal/phantom against its emulated peer.
