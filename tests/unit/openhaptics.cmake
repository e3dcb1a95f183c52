# hal/openhaptics against its emulated peer.
