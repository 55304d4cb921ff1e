// The same problem in Ceres, with automatic and with analytic derivatives, a block an observation and a block a line, and in a plain
// loop. See ../run.sh.
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <vector>

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Segment {
  double start, duration;
  double rotation[4];
  double position[3], rate[3], velocity[3];
};
struct Observation {
  double stamp, point[3], whitener[3], line;
};
struct Line {
  double anchor[3], axes[3][3];
};
struct Problem {
  double sheet[3][3], origin[3];
  double time_offset, rotation[4], translation[3];
  std::vector<Line> lines;
  std::vector<Segment> segments;
  std::vector<Observation> observations;
  double sigma[7];
};

static Problem read(const char* file) {
  std::ifstream in(file, std::ios::binary);
  auto fill = [&in](void* to, size_t bytes) { in.read(static_cast<char*>(to), bytes); };
  double counts[3];
  fill(counts, sizeof counts);
  Problem p;
  fill(p.sheet, sizeof p.sheet);
  fill(p.origin, sizeof p.origin);
  fill(&p.time_offset, sizeof(double));
  fill(p.rotation, sizeof p.rotation);
  fill(p.translation, sizeof p.translation);
  p.lines.resize(static_cast<size_t>(counts[1]));
  p.segments.resize(static_cast<size_t>(counts[2]));
  p.observations.resize(static_cast<size_t>(counts[0]));
  fill(p.lines.data(), p.lines.size() * sizeof(Line));
  fill(p.segments.data(), p.segments.size() * sizeof(Segment));
  fill(p.observations.data(), p.observations.size() * sizeof(Observation));
  fill(p.sigma, sizeof p.sigma);
  return p;
}

static double value(double x) { return x; }
template <typename T, int N>
static double value(const ceres::Jet<T, N>& x) { return x.a; }

// Where the search for an observation's segment begins: at the start's time offset, found before anything is timed.
static int first_hint(const Problem& p, const Observation& o) {
  auto later = [](double time, const Segment& s) { return time < s.start; };
  const auto next = std::upper_bound(p.segments.begin(), p.segments.end(), o.stamp - p.time_offset, later);
  return std::max(0, static_cast<int>(next - p.segments.begin()) - 1);
}

// The segment that holds a time, from where the last search ended.
static const Segment& segment_at(const Problem& p, double time, int& hint) {
  const int last = static_cast<int>(p.segments.size()) - 1;
  while (hint < last && p.segments[hint + 1].start <= time) ++hint;
  while (hint > 0 && p.segments[hint].start > time) --hint;
  return p.segments[hint];
}

struct Sighting {
  const Problem& p;
  const Observation& o;
  mutable int hint;

  template <typename T>
  bool operator()(const T* offset, const T* turn, const T* shift, const T* line, T* residual) const {
    const Segment& s = segment_at(p, o.stamp - value(offset[0]), hint);
    const T elapsed = T(o.stamp - s.start) - offset[0];
    T rate[3], step[4], from[4], tool[4], delta[4], camera[4], start[4];
    for (int k = 0; k < 3; ++k) rate[k] = elapsed * s.rate[k];
    for (int k = 0; k < 4; ++k) {
      from[k] = T(s.rotation[k]);
      start[k] = T(p.rotation[k]);
    }
    ceres::AngleAxisToQuaternion(rate, step);
    ceres::QuaternionProduct(from, step, tool);
    ceres::AngleAxisToQuaternion(turn, delta);
    ceres::QuaternionProduct(delta, start, camera);
    T point[3] = {T(o.point[0]), T(o.point[1]), T(o.point[2])}, in_tool[3], in_base[3];
    ceres::UnitQuaternionRotatePoint(camera, point, in_tool);
    for (int k = 0; k < 3; ++k) in_tool[k] += T(p.translation[k]) + shift[k];
    ceres::UnitQuaternionRotatePoint(tool, in_tool, in_base);
    const Line& l = p.lines[static_cast<size_t>(o.line)];
    T bend[3], direction[3], first[3], off[3];
    for (int k = 0; k < 3; ++k) {
      bend[k] = line[0] * l.axes[1][k] + line[1] * l.axes[2][k];
      first[k] = T(l.axes[0][k]);
      off[k] = in_base[k] + T(s.position[k]) + elapsed * s.velocity[k] - T(l.anchor[k]) -
               line[2] * l.axes[1][k] - line[3] * l.axes[2][k];
    }
    ceres::AngleAxisRotatePoint(bend, first, direction);
    T both[4], axis[3][3];
    ceres::QuaternionProduct(tool, camera, both);
    for (int a = 0; a < 3; ++a) {
      T own[3] = {T(p.sheet[a][0]), T(p.sheet[a][1]), T(p.sheet[a][2])};
      ceres::UnitQuaternionRotatePoint(both, own, axis[a]);
    }
    const T along = ceres::DotProduct(axis[2], off) / ceres::DotProduct(axis[2], direction);
    for (int k = 0; k < 3; ++k) off[k] -= direction[k] * along;
    const T r1 = ceres::DotProduct(axis[0], off), r2 = ceres::DotProduct(axis[1], off);
    residual[0] = o.whitener[0] * r1;
    residual[1] = o.whitener[1] * r1 + o.whitener[2] * r2;
    return true;
  }
};

static Matrix3d hat(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

static Matrix3d left_jacobian(const Vector3d& w) {
  const double angle = w.norm();
  const Matrix3d h = hat(w);
  if (angle < 1e-4) return Matrix3d::Identity() + 0.5 * h + h * h / 6;
  return Matrix3d::Identity() + (1 - std::cos(angle)) / (angle * angle) * h +
         (angle - std::sin(angle)) / (angle * angle * angle) * h * h;
}

static Quaterniond exponential(const Vector3d& w) {
  const double angle = w.norm();
  const double s = angle < 1e-6 ? 0.5 - angle * angle / 48 : std::sin(0.5 * angle) / angle;
  return Quaterniond(std::cos(0.5 * angle), s * w.x(), s * w.y(), s * w.z());
}

class Analytic : public ceres::SizedCostFunction<2, 1, 3, 3, 4> {
 public:
  Analytic(const Problem& p, const Observation& o) : p_(p), o_(o), hint_(first_hint(p, o)) {}

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    using Row3 = Eigen::Matrix<double, 2, 3>;
    using Row4 = Eigen::Matrix<double, 2, 4>;
    const Segment& s = segment_at(p_, o_.stamp - x[0][0], hint_);
    const double elapsed = o_.stamp - s.start - x[0][0];
    const Vector3d rate(s.rate), velocity(s.velocity), turn(x[1]);
    const Quaterniond from(s.rotation[0], s.rotation[1], s.rotation[2], s.rotation[3]);
    const Quaterniond start(p_.rotation[0], p_.rotation[1], p_.rotation[2], p_.rotation[3]);
    const Matrix3d tool = (from * exponential(rate * elapsed)).toRotationMatrix();
    const Matrix3d camera = (exponential(turn) * start).toRotationMatrix();
    const Vector3d mount = Vector3d(p_.translation) + Vector3d(x[2]);
    const Line& l = p_.lines[static_cast<size_t>(o_.line)];
    const Vector3d u1(l.axes[0]), u2(l.axes[1]), u3(l.axes[2]);
    const Vector3d bend = u2 * x[3][0] + u3 * x[3][1];
    const Vector3d direction = exponential(bend) * u1;
    const Vector3d anchor = Vector3d(l.anchor) + u2 * x[3][2] + u3 * x[3][3];
    const Vector3d point(o_.point);
    const Vector3d origin = Vector3d(s.position) + velocity * elapsed;
    const Vector3d off = tool * (camera * point + mount) + origin - anchor;
    Eigen::Matrix<double, 3, 2> axes;
    axes.col(0) = Vector3d(p_.sheet[0]);
    axes.col(1) = Vector3d(p_.sheet[1]);
    const Matrix3d both = tool * camera;
    const Vector3d normal = both * Vector3d(p_.sheet[2]);
    const Eigen::Matrix<double, 2, 3> in_sheet = (both * axes).transpose();
    const Row3 onto = in_sheet - (in_sheet * direction / normal.dot(direction)) * normal.transpose();
    const Eigen::Vector2d residual = onto * off;
    Eigen::Matrix2d whiten;
    whiten << o_.whitener[0], 0, o_.whitener[1], o_.whitener[2];
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = whiten * residual;
    if (jacobians == nullptr) return true;
    const Row3 w = whiten * onto;
    const Vector3d predicted = point - axes * residual;
    const Vector3d arm_camera = camera * predicted;
    const Vector3d lever = tool * (arm_camera + mount);
    if (jacobians[0]) {
      Eigen::Map<Eigen::Vector2d> j(jacobians[0]);
      j = w * (lever.cross(tool * rate) - velocity);
    }
    if (jacobians[1]) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> j(jacobians[1]);
      j = -w * tool * hat(arm_camera) * left_jacobian(turn);
    }
    if (jacobians[2]) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> j(jacobians[2]);
      j = w * tool;
    }
    if (jacobians[3]) {
      Eigen::Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>> j(jacobians[3]);
      const Vector3d arm = lever + origin - anchor;
      const Matrix3d jl = left_jacobian(bend);
      Row4 columns;
      columns.col(0) = -w * (jl * u2).cross(arm);
      columns.col(1) = -w * (jl * u3).cross(arm);
      columns.col(2) = -w * u2;
      columns.col(3) = -w * u3;
      j = columns;
    }
    return true;
  }

 private:
  const Problem& p_;
  const Observation& o_;
  mutable int hint_;
};

// All observations of a line in one block: Ceres then calls once and multiplies tall matrices.
class WholeLine : public ceres::CostFunction {
 public:
  explicit WholeLine(std::vector<std::unique_ptr<ceres::CostFunction>> each) : each_(std::move(each)) {
    set_num_residuals(static_cast<int>(2 * each_.size()));
    *mutable_parameter_block_sizes() = {1, 3, 3, 4};
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    static const int width[4] = {1, 3, 3, 4};
    for (size_t i = 0; i < each_.size(); ++i) {
      double* rows[4];
      for (int b = 0; jacobians && b < 4; ++b) rows[b] = jacobians[b] ? jacobians[b] + 2 * i * width[b] : nullptr;
      if (!each_[i]->Evaluate(x, residuals + 2 * i, jacobians ? rows : nullptr)) return false;
    }
    return true;
  }

 private:
  std::vector<std::unique_ptr<ceres::CostFunction>> each_;
};

struct Unknowns {
  double offset[1], turn[3], shift[3];
  std::vector<std::array<double, 4>> lines;

  explicit Unknowns(const Problem& p) : turn{}, shift{}, lines(p.lines.size(), std::array<double, 4>{}) {
    offset[0] = p.time_offset;
  }

  std::array<double, 7> clock_and_sensor() const {
    return {offset[0], turn[0], turn[1], turn[2], shift[0], shift[1], shift[2]};
  }

  // How far from other values, in standard deviations.
  double away(const Unknowns& other, const Problem& p) const {
    const auto mine = clock_and_sensor(), theirs = other.clock_and_sensor();
    double worst = 0;
    for (int k = 0; k < 7; ++k) worst = std::max(worst, std::abs(mine[k] - theirs[k]) / p.sigma[k]);
    return worst;
  }
};

static std::unique_ptr<ceres::CostFunction> cost_of(const Problem& p, const Observation& o, bool automatic) {
  using Automatic = ceres::AutoDiffCostFunction<Sighting, 2, 1, 3, 3, 4>;
  if (automatic) return std::make_unique<Automatic>(new Sighting{p, o, first_hint(p, o)});
  return std::make_unique<Analytic>(p, o);
}

static void add_blocks(ceres::Problem& problem, const Problem& p, Unknowns& x, bool automatic, bool whole_lines) {
  std::vector<std::vector<std::unique_ptr<ceres::CostFunction>>> of_line(p.lines.size());
  for (const Observation& o : p.observations) {
    const size_t line = static_cast<size_t>(o.line);
    std::unique_ptr<ceres::CostFunction> cost = cost_of(p, o, automatic);
    if (whole_lines)
      of_line[line].push_back(std::move(cost));
    else
      problem.AddResidualBlock(cost.release(), nullptr, x.offset, x.turn, x.shift, x.lines[line].data());
  }
  for (size_t line = 0; whole_lines && line < of_line.size(); ++line)
    problem.AddResidualBlock(new WholeLine(std::move(of_line[line])), nullptr, x.offset, x.turn, x.shift,
                             x.lines[line].data());
}

// Seconds of a solve of so many steps, and where it ends; building the problem is not counted.
static double with_ceres(const Problem& p, bool automatic, bool whole_lines, int steps, Unknowns& x) {
  ceres::Problem problem;
  add_blocks(problem, p, x, automatic, whole_lines);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.num_threads = 1;
  // The start is good enough for full steps; with the default radius it takes eight instead of five.
  options.initial_trust_region_radius = 1e12;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 0;
  options.max_num_iterations = steps;
  ceres::Solver::Summary summary;
  const auto began = std::chrono::steady_clock::now();
  ceres::Solve(options, &problem, &summary);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

// The same analytic derivatives in a plain loop: what is the same for all observations is computed once a step, and the sums are taken at
// once, without a Jacobian in memory.
static double in_a_loop(const Problem& p, int steps, Unknowns& x) {
  using Local = Eigen::Matrix<double, 11, 1>;
  const int lines = static_cast<int>(p.lines.size()), size = 7 + 4 * lines;
  std::vector<int> hints(p.observations.size());
  for (size_t i = 0; i < hints.size(); ++i) hints[i] = first_hint(p, p.observations[i]);
  const Quaterniond start(p.rotation[0], p.rotation[1], p.rotation[2], p.rotation[3]);
  Eigen::Matrix<double, 3, 2> axes;
  axes << Vector3d(p.sheet[0]), Vector3d(p.sheet[1]);
  struct Held {
    Vector3d u2, u3, direction, anchor, turned2, turned3;
    Eigen::Matrix<double, 11, 11> hessian;
    Local gradient;
  };
  std::vector<Held> held(lines);
  const auto began = std::chrono::steady_clock::now();
  for (int step = 0; step < steps; ++step) {
    const Vector3d turn(x.turn), mount = Vector3d(p.translation) + Vector3d(x.shift);
    const Matrix3d camera = (exponential(turn) * start).toRotationMatrix(), turned = left_jacobian(turn);
    const Eigen::Matrix<double, 3, 2> camera_axes = camera * axes;
    const Vector3d camera_normal = camera * Vector3d(p.sheet[2]);
    for (int k = 0; k < lines; ++k) {
      const Line& l = p.lines[k];
      Held& h = held[k];
      h.u2 = Vector3d(l.axes[1]), h.u3 = Vector3d(l.axes[2]);
      const Vector3d bend = h.u2 * x.lines[k][0] + h.u3 * x.lines[k][1];
      h.direction = exponential(bend) * Vector3d(l.axes[0]);
      h.anchor = Vector3d(l.anchor) + h.u2 * x.lines[k][2] + h.u3 * x.lines[k][3];
      h.turned2 = left_jacobian(bend) * h.u2, h.turned3 = left_jacobian(bend) * h.u3;
      h.hessian.setZero(), h.gradient.setZero();
    }
    for (size_t i = 0; i < hints.size(); ++i) {
      const Observation& o = p.observations[i];
      Held& h = held[static_cast<size_t>(o.line)];
      const Segment& s = segment_at(p, o.stamp - x.offset[0], hints[i]);
      const double elapsed = o.stamp - s.start - x.offset[0];
      const Vector3d rate(s.rate), velocity(s.velocity);
      const Quaterniond from(s.rotation[0], s.rotation[1], s.rotation[2], s.rotation[3]);
      const Matrix3d tool = (from * exponential(rate * elapsed)).toRotationMatrix();
      const Vector3d arm = camera * Vector3d(o.point), origin = Vector3d(s.position) + velocity * elapsed;
      const Vector3d off = tool * (arm + mount) + origin - h.anchor;
      const Vector3d normal = tool * camera_normal;
      const Eigen::Matrix<double, 2, 3> in_sheet = (tool * camera_axes).transpose();
      const Eigen::Matrix<double, 2, 3> onto =
          in_sheet - (in_sheet * h.direction / normal.dot(h.direction)) * normal.transpose();
      const Eigen::Vector2d residual = onto * off;
      Eigen::Matrix2d whiten;
      whiten << o.whitener[0], 0, o.whitener[1], o.whitener[2];
      const Eigen::Matrix<double, 2, 3> w = whiten * onto, w_tool = w * tool;
      const Vector3d predicted = arm - camera_axes * residual, lever = tool * (predicted + mount);
      const Vector3d to_line = lever + origin - h.anchor;
      Eigen::Matrix<double, 2, 11> j;
      j.col(0) = w * (lever.cross(tool * rate) - velocity);
      j.middleCols<3>(1) = -w_tool * (hat(predicted) * turned);
      j.middleCols<3>(4) = w_tool;
      j.col(7) = -w * h.turned2.cross(to_line);
      j.col(8) = -w * h.turned3.cross(to_line);
      j.col(9) = -w * h.u2;
      j.col(10) = -w * h.u3;
      h.hessian.noalias() += j.transpose() * j;
      h.gradient.noalias() += j.transpose() * (whiten * residual);
    }
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
    for (int k = 0; k < lines; ++k) {
      const int at = 7 + 4 * k;
      hessian.topLeftCorner<7, 7>() += held[k].hessian.topLeftCorner<7, 7>();
      hessian.block<4, 7>(at, 0) = held[k].hessian.bottomLeftCorner<4, 7>();
      hessian.block<4, 4>(at, at) = held[k].hessian.bottomRightCorner<4, 4>();
      gradient.head<7>() += held[k].gradient.head<7>();
      gradient.segment<4>(at) = held[k].gradient.tail<4>();
    }
    const Eigen::VectorXd by = -hessian.selfadjointView<Eigen::Lower>().ldlt().solve(gradient);
    x.offset[0] += by[0];
    for (int k = 0; k < 3; ++k) x.turn[k] += by[1 + k], x.shift[k] += by[4 + k];
    for (int k = 0; k < 4 * lines; ++k) x.lines[k / 4][k % 4] += by[7 + k];
  }
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

// Every side ends with the first step that is shorter than a millionth of a standard deviation. Which that is, is found before anything
// is timed, so that no time is spent on asking.
static void run(const Problem& p, const char* name, const std::function<double(int, Unknowns&)>& solve) {
  const int repeats = 12, most = 50;
  int steps = 1;
  for (Unknowns before(p); steps < most; ++steps) {
    Unknowns after(p);
    solve(steps, after);
    if (after.away(before, p) < 1e-6) break;
    before = after;
  }
  Unknowns x(p);
  double best = 1e9;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    x = Unknowns(p);
    best = std::min(best, solve(steps, x));
  }
  std::printf("{\"side\":\"%s\",\"found\":[%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g],\"iterations\":%d,\"seconds\":%.6e}\n",
              name, x.offset[0], x.turn[0], x.turn[1], x.turn[2], x.shift[0], x.shift[1], x.shift[2], steps, best);
}

int main(int, char** arguments) {
  const Problem p = read(arguments[1]);
  run(p, "the same arithmetic in a plain loop (Eigen)", [&](int steps, Unknowns& x) { return in_a_loop(p, steps, x); });
  for (bool whole_lines : {true, false})
    for (bool automatic : {false, true}) {
      const std::string name = std::string("Ceres " CERES_VERSION_STRING ", ") +
                               (automatic ? "automatic" : "analytic") + " derivatives, a block " +
                               (whole_lines ? "a line" : "an observation");
      run(p, name.c_str(), [&](int steps, Unknowns& x) { return with_ceres(p, automatic, whole_lines, steps, x); });
    }
}
