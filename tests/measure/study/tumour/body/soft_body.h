#pragma once

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <array>
#include <vector>

namespace hapticd::study {

/// A half-sphere of soft silicone, bonded to the table, with or without a stiffer sphere in it, pressed by a
/// frictionless ball. Units: mm, N, N/mm² (MPa).
struct SoftBodyParameters {
  double radius_mm = 55.0;
  double tip_radius_mm = 8.0;
  /// Yeoh, third order: W = Σ c_i q^i with q = I1 - 3 - 2 ln J.
  std::array<double, 3> yeoh_n_per_mm2{};
  double bulk_ratio = 50.0;  ///< bulk over shear modulus: nearly incompressible
  double inclusion_radius_mm = 0.0;
  double inclusion_depth_mm = 25.0;  ///< of its centre below the apex
  double inclusion_factor = 1.0;     ///< stiffness over that of the tissue
  int layers = 10;                   ///< elements from the base to the apex; 2 × as many across
};

/// Place of the ball, and what the body answers.
struct SoftBodyState {
  double energy_n_mm = 0.0;
  Eigen::Vector3d force_n;       ///< on the ball
  Eigen::Vector3d inclusion_mm;  ///< mean displacement of the inclusion
  double residual = 0.0;         ///< of the balance of forces over the contact force
};

/// Static finite elements: trilinear hexahedra, 2 × 2 × 2 points, the change of volume by its mean in each
/// element. One half of the body, for the ball stays in the plane of symmetry y = 0. Newton's method in
/// large deformation; each step is solved by conjugate gradients with an older factor of the stiffness.
class SoftBody {
 public:
  explicit SoftBody(const SoftBodyParameters& parameters);

  /// Resets to a body without load.
  void reset();
  /// The ball's centre, from the centre of the base; goes on from the last state. False: no balance found.
  bool press(const Eigen::Vector3d& centre_mm);
  SoftBodyState state() const;
  std::size_t unknowns() const { return free_count_; }

 private:
  using Vector = Eigen::VectorXd;
  struct Point {
    Eigen::Matrix<double, 3, 8> gradient;  ///< of the shape functions, per mm
    double weight = 0.0;                   ///< mm³
    double factor = 1.0;                   ///< stiffness over the tissue's
    bool in_inclusion = false;
    Eigen::Matrix<double, 8, 1> shape;
  };
  struct Element {
    std::array<int, 8> nodes{};
    std::array<Point, 8> points{};
    double volume = 0.0;
  };
  struct SurfacePoint {
    std::array<int, 4> nodes{};
    std::array<double, 4> shape{};
    double area_mm2 = 0.0;
    Eigen::Vector3d place_mm;  ///< on the sphere itself, not on the facet
  };

  void mesh();
  /// Energy at a displacement; infinite if an element is turned inside out. Gradient and stiffness too if
  /// they are asked for.
  double evaluate(const Vector& u, Vector* gradient, Eigen::SparseMatrix<double>* stiffness) const;
  bool solve(const Eigen::SparseMatrix<double>& stiffness, const Vector& gradient, Vector& step);
  bool balance();

  SoftBodyParameters p_;
  std::vector<Eigen::Vector3d> nodes_;
  std::vector<std::array<int, 3>> unknown_;  ///< of each node's axes; -1 where it is held
  std::size_t free_count_ = 0;
  std::vector<Element> elements_;
  std::vector<SurfacePoint> surface_;
  Eigen::Vector3d ball_;
  Vector u_;
  Vector before_;  ///< of the last press, to go on along the same line
  Eigen::Vector3d ball_before_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
  bool has_factor_ = false;
  bool analysed_ = false;
  double residual_ = 0.0;
};

}  // namespace hapticd::study
