# hal/modbus against its emulated peer.
