// Reads what can be wrong with an experiment out of ARGoS's configuration, before ARGoS itself
// stumbles over it. Called on the main thread while the experiment is loaded.
#pragma once

namespace swarmtalk::platforms::in_argos {

/// Looks at the file once, at the first call.
/// @throws argos::CARGoSException with one line that says what is wrong
void check_experiment_file();

}  // namespace swarmtalk::platforms::in_argos
