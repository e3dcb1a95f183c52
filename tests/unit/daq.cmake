# hal/daq against its emulated peer.
