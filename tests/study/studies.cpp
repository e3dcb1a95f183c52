#include "tests/study/explore/explore_study.h"
#include "tests/study/extremes/extremes_study.h"
#include "tests/study/faults/faults_study.h"
#include "tests/study/identify/identify_study.h"
#include "tests/study/machine/machine_study.h"
#include "tests/study/page.h"
#include "tests/study/precision/precision_study.h"
#include "tests/study/rig/rig_study.h"
#include "tests/study/stability/stability_study.h"
#include "tests/study/study.h"

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
           {"recordings", "contact, stiffness and rendered force on real recordings", run_recordings},
       },
       {
           {"rendered", "the same stiffness over emulated real transports, live and beside the direct rig",
            run_transported_stiffness},
       }},
      {"explore",
       "stiffness modulation in three dimensions, beside the dissertation's pipeline and figures",
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
           {"contact_recordings", "contact laws across real recordings", run_identify_contact_recordings},
           {"friction", "rod and ball bearing on the simulated objects", run_identify_friction},
           {"friction_recordings", "friction laws on real recordings", run_identify_friction_recordings},
           {"rig", "structural stiffness, tool, contact threshold and gains", run_identify_rig},
           {"handover", "tool and threshold of a real hand-held sensor", run_identify_handover},
       }},
      {"faults",
       "every fault injected at the emulated peers while force is rendered in contact",
       {
           {"faults", "ticks from fault to zero force, what is told, and how force comes back", run_faults},
       }},
      {"report",
       "one page: error against run time, stability maps, numerical extremes, what scenes and loop cost",
       {
           {"motion", "error against run time: velocity and acceleration", run_motion_precision},
           {"detection", "error against run time: contact, delay against false alarms",
            run_detection_precision},
           {"estimation", "error against run time: direction, displacement, friction",
            run_estimation_precision},
           {"identification", "error against run time: identification of contact laws",
            run_identification_precision},
           {"rates", "error against run time: rate of loop and telemetry", run_rate_precision},
           {"integrators", "error against run time: the simulator's integrators and steps",
            run_integrator_precision},
           {"maps", "stability: object stiffness against target stiffness", run_stability_maps, true},
           {"sensitivity", "stability: what each uncertain parameter does", run_stability_sensitivity, true},
           {"wood", "stability: the wood plate, why it is unstable and what would help", run_wood_plate,
            true},
           {"extremes", "numerical extremes of every stage", run_extremes, true},
           {"traps", "published equations that fail, beside those used here", run_traps},
           {"scenes", "what each scene composes and costs, beside everything forced on", run_scene_economy},
           {"realtime", "the live loop under load beside cyclictest, command to effect, telemetry fan-out",
            run_realtime_cost},
       },
       {},
       write_report_page},
  };
  return all;
}

}  // namespace hapticd::study
