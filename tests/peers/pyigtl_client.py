#!/usr/bin/env python3
"""pyigtl reads the tool's pose from hapticd-igtl, and sends it what is wrong or unknown.

    pyigtl_client.py [PORT]       needs pyigtl and numpy (pip install pyigtl), a daemon, and hapticd-igtl on that port [18944]
"""

import sys
import time

try:
    import numpy as np
    import pyigtl
except ImportError as missing:
    print(f"SKIPPED LOUDLY: {missing}", file=sys.stderr)
    sys.exit(77)

SECONDS = 5.0

client = pyigtl.OpenIGTLinkClient("127.0.0.1", int(sys.argv[1]) if len(sys.argv) > 1 else 18944)
stamps = []
end = time.monotonic() + SECONDS
while time.monotonic() < end:
    message = client.wait_for_message("ToolToRig", timeout=3)
    assert message is not None, "no ToolToRig within 3 s"
    turn = message.matrix[:3, :3]
    assert np.abs(turn @ turn.T - np.eye(3)).max() < 1e-5 and np.linalg.det(turn) > 0, message.matrix
    stamps.append(message.timestamp)
    if len(stamps) % 20 == 0:  # none of these may end the connection
        client.send_message(pyigtl.TransformMessage(np.full((4, 4), np.nan), device_name="Wrong"))
        client.send_message(pyigtl.TransformMessage(np.diag([-1.0, 1.0, 1.0, 1.0]), device_name="Mirrored"))
        client.send_message(pyigtl.StringMessage("hello", device_name="Text"))
        client.send_message(pyigtl.ImageMessage(np.zeros((4, 8, 8), np.uint8), device_name="Picture"))
assert all(later > before for before, later in zip(stamps, stamps[1:])), "the stamps do not increase"
print(f"pyigtl: {len(stamps)} poses, the newest {time.time() - stamps[-1]:.3f} s old")
