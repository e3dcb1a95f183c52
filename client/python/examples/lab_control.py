"""A laboratory's workstation: sets a stiffness, looks at ten seconds, keeps a picture of them."""

import sys

import hapticd

with hapticd.connect(sys.argv[1] if len(sys.argv) > 1 else None) as rig, rig.lease("lab control"):
    rig.load_scene("tap_1d")
    answer = rig.set_target(0.3)
    print(f"granted {answer.granted_n_per_mm:.2f} N/mm {hapticd.printable(answer.explanation)}")
    data = rig.read(float(sys.argv[2]) if len(sys.argv) > 2 else 10.0, ["contact", "deformation", "control"])
print(f"{len(data)} samples, {data.lost} lost, at most {data['contact_reaction_force_n'].max():.2f} N")
data.plot("contact_reaction_force_n", "deformation_displacement_mm").savefig("press.svg")
