#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/page.h"
#include "tests/measure/study/common/rig_study.h"
#include "tests/measure/study/common/study.h"
#include "tests/measure/study/experiments/experiments_study.h"
#include "tests/measure/study/extremes/extremes_study.h"
#include "tests/measure/study/faults/faults_study.h"
#include "tests/measure/study/identify/identify_study.h"
#include "tests/measure/study/loading/loading_study.h"
#include "tests/measure/study/loading/onset.h"
#include "tests/measure/study/machine/machine_study.h"
#include "tests/measure/study/modulation/modulation_study.h"
#include "tests/measure/study/pose/pose_study.h"
#include "tests/measure/study/precision/precision_study.h"
#include "tests/measure/study/registration/registration_study.h"
#include "tests/measure/study/stability/stability_study.h"
#include "tests/measure/study/trust/trust_study.h"
#include "tests/measure/study/tumour/tumour_study.h"

namespace hapticd::study {

const std::vector<Study>& studies() {
  static const std::vector<Study> all{
      {"rig",
       "the one-dimensional system on the simulated rig and on real recordings",
       {
           {"rendered", "stiffness at the simulated hand against the target", run_rendered_stiffness},
           {"contact", "false alarms in free motion, delay of detection", run_contact},
           {"stability", "largest stable targets and walls, sensitivity to uncertain parameters",
            run_stability},
           {"speed", "simulated time over wall-clock time", run_speed},
           {"recordings", "contact, stiffness and rendered force on real recordings", run_recordings,
            PlantUse::kNone},
       },
       {
           {"rendered", "the same stiffness over emulated real transports, live and next to the direct rig",
            run_transported_stiffness, PlantUse::kSeparable},
       }},
      {"explore",
       "stiffness modulation in three dimensions, next to the dissertation's pipeline and figures",
       {
           {"models", "what is identified on the four objects; the models as files", run_models},
           {"contact", "threshold without false alarms, delay of detection", run_explore_contact},
           {"estimation", "direction and displacement on the same strokes", run_estimation},
           {"stability", "largest stable target while stroking", run_explore_stability},
           {"rendered", "stiffness at the simulated hand at 0.3 and 0.8 N/mm", run_explore_rendered},
           {"phenomena", "whether the dissertation's pipeline shows what it showed there", run_phenomena},
           {"difficult", "a sticky gel and a ridge", run_difficult},
           {"gains", "ultimate-gain search for the controller", run_gains},
       }},
      {"identify",
       "models from touching simulated objects and from real recordings",
       {
           {"contact", "laws and methods on the simulated objects, error against run time",
            run_identify_contact},
           {"contact_recordings", "contact laws across real recordings", run_identify_contact_recordings,
            PlantUse::kNone},
           {"compression_recordings", "contact laws on compressed EcoFlex",
            run_identify_compression_recordings, PlantUse::kNone},
           {"friction", "rod and ball bearing on the simulated objects", run_identify_friction},
           {"friction_recordings", "friction laws on real recordings", run_identify_friction_recordings,
            PlantUse::kNone},
           {"shipped_models", "the models that ship, by the service's own identification",
            run_identify_shipped_models, PlantUse::kSeparable},
           {"rig", "structural stiffness, tool and contact threshold", run_identify_rig, PlantUse::kNone},
           {"gains", "gains of the controller, pressed by a hand", run_identify_gains},
           {"handover", "tool and threshold of a real hand-held sensor", run_identify_handover,
            PlantUse::kNone},
       },
       {
           {"transport", "live over emulated real transports and next to the direct rig",
            run_identify_transport, PlantUse::kSeparable},
       }},
      {"tumour",
       "a virtual tumour against real ones in a phantom",
       {
           {"force", "force over displacement next to the tumour, published and by energy", run_tumour_force,
            PlantUse::kSeparable},
           {"place", "where an inclusion is, from a palpation scan", run_inclusion_place,
            PlantUse::kSeparable},
           {"bounds", "jumps, bounds and energy of the law", run_tumour_bounds, PlantUse::kNone},
       }},
      {"registration",
       "arms calibrated by a tracker: where the tip is in its frame, against the truth",
       {
           {"error", "target error by method, predicted and observed; latency, orientation", run_registration,
            PlantUse::kNone},
           {"length", "error against how long one moves, and against run time", run_registration_length,
            PlantUse::kNone},
       }},
      {"experiments",
       "perception experiments with simulated observers, and the Python client",
       {
           {"estimators", "error of estimates, coverage of their intervals", run_estimators, PlantUse::kNone},
           {"resume", "sessions killed after each event", run_resume, PlantUse::kNone},
           {"assistance", "speed of the guide, force of the fixture along a press", run_guided_presses,
            PlantUse::kNone},
           {"telemetry", "what telemetry costs a Python program", run_python_telemetry, PlantUse::kNone},
           {"chain",
            "the dissertation's three experiments through daemon, table, guide, journal and analysis",
            run_chain, PlantUse::kNone},
       }},
      {"friction",
       "the friction of a real object against its target",
       {
           {"target", "kinetic friction, presliding and chatter at the hand", run_friction_target},
           {"stiffness", "the rendered stiffness with a friction target and without", run_friction_stiffness},
       }},
      {"transients",
       "contact transients against their targets",
       {
           {"frequency", "frequency and decay at the grip, at 5 kHz and at 1 kHz", run_transient_frequency,
            PlantUse::kSeparable},
           {"hardness", "extended rate-hardness of transients and of stiffness shifting",
            run_transient_hardness, PlantUse::kSeparable},
       }},
      {"faults",
       "every fault injected at the emulated peers while force is rendered in contact",
       {
           {"faults", "ticks from fault to zero force, what is reported, and how force comes back",
            run_faults, PlantUse::kSeparable},
       }},
      {"loading",
       "the force at the hand while it presses, not only while it holds",
       {
           {"error", "error at 2, 10 and 30 N/s and held, with and without compensation", run_loading_error},
           {"budget", "which part of the error each cause makes, by switching it off in the rig",
            run_loading_budget},
       }},
      {"onset",
       "how a contact begins to be felt",
       {
           {"force", "first force, its depth and the steepest slope, by object, device and speed", run_onset},
       }},
      {"trust",
       "where nothing is touched the device gives no force, whatever a clock, a sensor or an object does",
       {
           {"free_air", "largest and longest force in free air, for every cause, scene, device and rate",
            run_free_air, PlantUse::kBoth, true},
           {"contact", "real taps and presses under the same causes: missed, dropped, late", run_contact_kept,
            PlantUse::kBoth, true},
           {"settings", "all settings that are accepted, at random: force in free air, steps of force",
            run_settings, PlantUse::kSeparable, true},
       }},
      {"pose",
       "poses for those who draw: when a contact began, and where the tool will be",
       {
           {"onset", "the instant of a contact, as reported and as noticed, against the true one",
            run_contact_onset},
           {"prediction", "poses 20 to 100 ms ahead, against none predicted, and their stated error",
            run_pose_prediction, PlantUse::kSeparable},
       }},
      {"report",
       "error against run time, stability, numerical extremes, what scenes and loop cost",
       {
           {"motion", "error against run time: velocity and acceleration", run_motion_precision,
            PlantUse::kNone},
           {"detection", "error against run time: contact, delay against false alarms",
            run_detection_precision},
           {"estimation", "error against run time: direction, displacement, friction",
            run_estimation_precision},
           {"modulation", "error against run time: inclusions, friction targets, transients",
            run_modulation_precision, PlantUse::kSeparable},
           {"identification", "error against run time: identification of contact laws",
            run_identification_precision},
           {"rates", "error against run time: rate of loop and telemetry", run_rate_precision},
           {"integrators", "error against run time: the simulator's integrators and steps",
            run_integrator_precision, PlantUse::kSeparable},
           {"maps", "stability: object stiffness against target stiffness", run_stability_maps,
            PlantUse::kBoth, true},
           {"inclusions", "stability: how stiff a rendered inclusion may be", run_inclusion_stability,
            PlantUse::kSeparable, true},
           {"sensitivity", "stability: what each uncertain parameter does", run_stability_sensitivity,
            PlantUse::kBoth, true},
           {"wood", "stability: the wood plate, why it is unstable and what would help", run_wood_plate,
            PlantUse::kBoth, true},
           {"extremes", "numerical extremes of every stage", run_extremes, PlantUse::kSeparable, true},
           {"traps", "published equations that fail, next to those used here", run_traps,
            PlantUse::kSeparable},
           {"scenes", "what each scene composes and costs, next to everything forced on", run_scene_economy,
            PlantUse::kNone},
           {"realtime", "the live loop under load next to cyclictest, command to effect, telemetry fan-out",
            run_realtime_cost, PlantUse::kSeparable},
       },
       {},
       summarize_report},
  };
  return all;
}

}  // namespace hapticd::study
