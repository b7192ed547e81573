// Force on a sphere among its nearest neighbours, by any model that dustfall exports.
//
// Plain C++11 for GCC and Clang, no library needed. Lengths are in particle diameters d_p, forces
// in Re_p c_D, where an isolated sphere feels 24 along the flow. The flow frame has x spanwise,
// y streamwise (the flow runs along +y) and z vertical. The mathematics is that of the Python
// package, which documents and tests it; here it is the numbers of the model file that decide
// frame, inputs, networks and baseline, so that one reader serves all kinds of models.
//
// Do not compile with -ffast-math: exact ties between neighbours must stay ties.

#ifndef DUSTFALL_FORCE_MODEL_HPP
#define DUSTFALL_FORCE_MODEL_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace dustfall {

const double STOKES_DRAG = 24.0;  // Re_p c_D
const double CONTACT = 1.0;       // centre distance of two touching spheres, d_p

const char* const FILE_FORMAT = "dustfall exported force model";
const int FILE_VERSION = 1;

// Largest difference from a file's test forces [Re_p c_D]: rounding reaches a hundredth of it.
const double TEST_TOLERANCE = 1e-9;

namespace detail {

// Scenes side by side, one in each element of a vector register.
#if defined(__AVX512F__)
const int WIDTH = 8;
#elif defined(__AVX__)
const int WIDTH = 4;
#else
const int WIDTH = 2;
#endif
typedef double Lanes __attribute__((vector_size(WIDTH * sizeof(double))));

inline Lanes lanes(double value) { return Lanes{} + value; }

inline Lanes root(Lanes value) {
    for (int lane = 0; lane < WIDTH; ++lane) value[lane] = std::sqrt(value[lane]);
    return value;
}

inline Lanes smaller(Lanes a, Lanes b) { return a < b ? a : b; }
inline Lanes larger(Lanes a, Lanes b) { return a > b ? a : b; }

struct Vector {
    Lanes x, y, z;
};

inline Vector operator+(const Vector& a, const Vector& b) {
    return Vector{a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vector operator-(const Vector& a, const Vector& b) {
    return Vector{a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vector operator*(const Lanes& s, const Vector& a) {
    return Vector{s * a.x, s * a.y, s * a.z};
}
inline Lanes dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector cross(const Vector& a, const Vector& b) {
    return Vector{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Working memory with the alignment of vector registers, which C++11's operator new ignores.
template <class T>
class Scratch {
public:
    explicit Scratch(std::size_t count) : bytes_(count * sizeof(T) + alignof(T)) {
        void* place = bytes_.data();
        std::size_t room = bytes_.size();
        first_ = static_cast<T*>(std::align(alignof(T), count * sizeof(T), place, room));
    }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
    T& operator[](std::size_t i) { return first_[i]; }
    T* data() { return first_; }

private:
    std::vector<char> bytes_;
    T* first_;
};

// Forces on all spheres of a scene by the Rotne-Prager mobility, the dipoles that they induce
// reflected between them, and every pair of the reference sphere exact: `Reflections` of the Python
// package (Rotne & Prager 1969; Yamakawa 1970; Kim & Karrila 1991; Durlofsky, Brady & Bossis 1987).
class HeldSpheres {
public:
    HeldSpheres(int neighbours, int reflections, const std::vector<double>& correction)
        : spheres_(neighbours + 1),
          reflections_(reflections),
          terms_(static_cast<int>(correction.size() / 2)),
          along_(correction.data()),
          across_(correction.data() + terms_),
          centre_(spheres_),
          total_(spheres_),
          change_(spheres_),
          gradient_(spheres_),
          pair_(spheres_ * (spheres_ - 1) / 2),
          factor_(spheres_ * (spheres_ + 1) / 2) {}

    // Force on the reference sphere, over Stokes drag, for neighbours no closer than contact.
    Vector force(const Vector* neighbour) {
        // The reference sphere comes last, after its neighbours.
        const int reference = spheres_ - 1;
        for (int j = 0; j < reference; ++j) centre_[j] = neighbour[j];
        centre_[reference] = Vector{};
        assemble();
        factorise();
        for (int i = 0; i < spheres_; ++i) total_[i] = Vector{Lanes{}, lanes(1.0), Lanes{}};
        solve(total_.data());
        Vector own = {};
        const int first = reference * (reference - 1) / 2;
        for (int j = 0; j < reference; ++j)
            own = own + correction(total_[reference], total_[j], pair_[first + j]);
        for (int i = 0; i < spheres_; ++i) change_[i] = total_[i];
        for (int n = 0; n < reflections_; ++n) {
            reflect();
            solve(change_.data());
            for (int i = 0; i < spheres_; ++i) total_[i] = total_[i] + change_[i];
        }
        return total_[reference] + own;
    }

private:
    struct Pair {
        Vector separation;
        Lanes p, s, t, w;  // coefficients of the gradients, see `add_gradient`
    };
    // Strain rate and rotation; the trace of the strain is zero.
    struct Gradient {
        Lanes xx, yy, xy, xz, yz;
        Vector rotation;
    };
    struct Block {
        Lanes m[3][3];
    };

    int spheres_, reflections_, terms_;
    const double *along_, *across_;
    Scratch<Vector> centre_, total_, change_;
    Scratch<Gradient> gradient_;
    Scratch<Pair> pair_;
    // Blocks (i, j <= i) of the mobility, then of its Cholesky factor, row by row, with the
    // diagonal of the factor inverted.
    Scratch<Block> factor_;

    void assemble() {
        int number = 0;
        for (int i = 0; i < spheres_; ++i) {
            Block* row = &factor_[i * (i + 1) / 2];
            for (int j = 0; j < i; ++j) couple(row[j], pair_[number++], centre_[i] - centre_[j]);
            for (int k = 0; k < 3; ++k)
                for (int l = 0; l < 3; ++l) row[i].m[k][l] = lanes(k == l ? 1.0 : 0.0);
        }
    }

    static void couple(Block& block, Pair& pair, const Vector& r) {
        // The floor keeps the mobility of two coincident neighbours positive definite.
        const Lanes distance2 = larger(dot(r, r), lanes(1e-12));
        Lanes inverse = 1.0 / root(distance2);
        Lanes square = inverse * inverse;
        const Lanes across = inverse < 1.0 ? 0.375 * inverse * (1.0 + square / 6.0)
                                           : 1.0 - 0.5625 / inverse;
        const Lanes along = inverse < 1.0 ? 0.375 * inverse * square * (1.0 - square / 2.0)
                                          : 0.1875 * inverse;
        const Vector a = along * r;
        block.m[0][0] = across + a.x * r.x;
        block.m[1][1] = across + a.y * r.y;
        block.m[2][2] = across + a.z * r.z;
        block.m[0][1] = block.m[1][0] = a.x * r.y;
        block.m[0][2] = block.m[2][0] = a.x * r.z;
        block.m[1][2] = block.m[2][1] = a.y * r.z;
        // Overlapping neighbours keep the other coefficients of contact: what they induce in each
        // other fades with their distance.
        inverse = smaller(inverse, lanes(1.0));
        square = inverse * inverse;
        const Lanes cube = 0.375 * inverse * square;
        pair.separation = r;
        // Gradient of the Rotne-Prager velocity with Faxen's a^2/10 of the strain.
        pair.p = -0.4 * cube * square;
        pair.s = cube * square * (2.0 * square - 3.0);
        pair.t = -(2.0 * pair.p + pair.s * distance2) / 3.0;
        pair.w = -cube;
    }

    void factorise() {
        for (int j = 0; j < spheres_; ++j) {
            const Block* column = &factor_[j * (j + 1) / 2];
            for (int i = j; i < spheres_; ++i) {
                Block* row = &factor_[i * (i + 1) / 2];
                Block own = row[j];
                for (int n = 0; n < j; ++n)
                    for (int k = 0; k < 3; ++k)
                        for (int l = 0; l < 3; ++l)
                            own.m[k][l] -= row[n].m[k][0] * column[n].m[l][0] +
                                           row[n].m[k][1] * column[n].m[l][1] +
                                           row[n].m[k][2] * column[n].m[l][2];
                if (i == j)
                    factorise(own);
                else
                    divide(own, column[j]);
                row[j] = own;
            }
        }
    }

    static void factorise(Block& block) {
        Lanes(&m)[3][3] = block.m;
        m[0][0] = 1.0 / root(m[0][0]);
        m[1][0] *= m[0][0];
        m[2][0] *= m[0][0];
        m[1][1] = 1.0 / root(m[1][1] - m[1][0] * m[1][0]);
        m[2][1] = (m[2][1] - m[2][0] * m[1][0]) * m[1][1];
        m[2][2] = 1.0 / root(m[2][2] - m[2][0] * m[2][0] - m[2][1] * m[2][1]);
    }

    // block <- block diagonal^-T
    static void divide(Block& block, const Block& diagonal) {
        const Lanes(&d)[3][3] = diagonal.m;
        for (int k = 0; k < 3; ++k) {
            Lanes* row = block.m[k];
            row[0] *= d[0][0];
            row[1] = (row[1] - row[0] * d[1][0]) * d[1][1];
            row[2] = (row[2] - row[0] * d[2][0] - row[1] * d[2][1]) * d[2][2];
        }
    }

    // Forces that move the spheres at given velocities, in place.
    void solve(Vector* vector) {
        for (int i = 0; i < spheres_; ++i) {
            const Block* row = &factor_[i * (i + 1) / 2];
            Vector own = vector[i];
            for (int j = 0; j < i; ++j) {
                const Lanes(&m)[3][3] = row[j].m;
                own.x -= dot(Vector{m[0][0], m[0][1], m[0][2]}, vector[j]);
                own.y -= dot(Vector{m[1][0], m[1][1], m[1][2]}, vector[j]);
                own.z -= dot(Vector{m[2][0], m[2][1], m[2][2]}, vector[j]);
            }
            const Lanes(&d)[3][3] = row[i].m;
            own.x *= d[0][0];
            own.y = (own.y - d[1][0] * own.x) * d[1][1];
            own.z = (own.z - d[2][0] * own.x - d[2][1] * own.y) * d[2][2];
            vector[i] = own;
        }
        for (int i = spheres_ - 1; i >= 0; --i) {
            const Block* row = &factor_[i * (i + 1) / 2];
            const Lanes(&d)[3][3] = row[i].m;
            Vector own = vector[i];
            own.z *= d[2][2];
            own.y = (own.y - d[2][1] * own.z) * d[1][1];
            own.x = (own.x - d[1][0] * own.y - d[2][0] * own.z) * d[0][0];
            vector[i] = own;
            for (int j = 0; j < i; ++j) {
                const Lanes(&m)[3][3] = row[j].m;
                vector[j].x -= dot(Vector{m[0][0], m[1][0], m[2][0]}, own);
                vector[j].y -= dot(Vector{m[0][1], m[1][1], m[2][1]}, own);
                vector[j].z -= dot(Vector{m[0][2], m[1][2], m[2][2]}, own);
            }
        }
    }

    // Forces `change_` into velocities, of the dipoles that the forces' flow induces.
    void reflect() {
        for (int i = 0; i < spheres_; ++i) gradient_[i] = Gradient{};
        int number = 0;
        for (int i = 0; i < spheres_; ++i)
            for (int j = 0; j < i; ++j, ++number) {
                const Pair& pair = pair_[number];
                const Vector& r = pair.separation;
                add_gradient(gradient_[i], change_[j], pair, r);
                add_gradient(gradient_[j], change_[i], pair, Vector{-r.x, -r.y, -r.z});
            }
        for (int i = 0; i < spheres_; ++i) change_[i] = Vector{};
        number = 0;
        for (int i = 0; i < spheres_; ++i)
            for (int j = 0; j < i; ++j, ++number) {
                const Pair& pair = pair_[number];
                const Vector& r = pair.separation;
                add_velocity(change_[j], gradient_[i], pair, r);
                add_velocity(change_[i], gradient_[j], pair, Vector{-r.x, -r.y, -r.z});
            }
    }

    // The strain rate and rotation that a force f causes at r, with q = r.f:
    // E = p (f r + r f) + s q r r + t q 1, trace free, and Omega = w f x r.
    static void add_gradient(Gradient& g, const Vector& f, const Pair& pair, const Vector& r) {
        const Lanes q = dot(r, f), sq = pair.s * q, tq = pair.t * q;
        const Vector pf = pair.p * f;
        g.xx += (2.0 * pf.x + sq * r.x) * r.x + tq;
        g.yy += (2.0 * pf.y + sq * r.y) * r.y + tq;
        g.xy += pf.x * r.y + pf.y * r.x + sq * r.x * r.y;
        g.xz += pf.x * r.z + pf.z * r.x + sq * r.x * r.z;
        g.yz += pf.y * r.z + pf.z * r.y + sq * r.y * r.z;
        g.rotation = g.rotation + pair.w * cross(f, r);
    }

    // The velocity that a sphere's stresslet and torque cause: `add_gradient` transposed.
    static void add_velocity(Vector& v, const Gradient& g, const Pair& pair, const Vector& r) {
        // A sphere of radius a = d_p/2 held in a strain rate E and a vorticity 2 Omega exerts the
        // stresslet 20/3 pi mu a^3 E and the torque 8 pi mu a^3 Omega; here over 6 pi mu a.
        const double stresslet = 10.0 / 9.0 * 0.25, torque = 4.0 / 3.0 * 0.25;
        const Vector strained = {g.xx * r.x + g.xy * r.y + g.xz * r.z,
                                 g.xy * r.x + g.yy * r.y + g.yz * r.z,
                                 g.xz * r.x + g.yz * r.y - (g.xx + g.yy) * r.z};
        v = v + 2.0 * stresslet * pair.p * strained +
            stresslet * pair.s * dot(strained, r) * r + torque * pair.w * cross(r, g.rotation);
    }

    // What the reflections leave out of a pair, in the flow that the other spheres cause at it:
    // the flow that the pair's mean Rotne-Prager force balances.
    Vector correction(const Vector& reference, const Vector& neighbour, const Pair& pair) const {
        const Vector& r = pair.separation;
        const Lanes inverse2 = 1.0 / larger(dot(r, r), lanes(1.0));
        const Lanes inverse = root(inverse2);
        const Vector mean = lanes(0.5) * (reference + neighbour);
        const Lanes across = 1.0 + 0.375 * inverse * (1.0 + inverse2 / 6.0);
        const Lanes along = 0.375 * inverse * inverse2 * (1.0 - 0.5 * inverse2) * dot(mean, r);
        const Vector flow = across * mean + along * r;
        Lanes straight = {}, sideways = {};
        for (int k = 0; k < terms_; ++k) {
            straight = straight * inverse + along_[k];
            sideways = sideways * inverse + across_[k];
        }
        const Lanes far = inverse2 * inverse2 * inverse2;
        sideways *= far;
        return sideways * flow + (straight * far - sideways) * inverse2 * dot(flow, r) * r;
    }
};

// Product with correctly rounded result, which contraction to a fused operation would change:
// equal distances of mirrored neighbours have to stay equal.
inline double product(double a, double b) {
    volatile double rounded = a * b;
    return rounded;
}

struct Point {
    double x, y, z;
};

inline double square(const Point& p) {
    return product(p.x, p.x) + product(p.y, p.y) + product(p.z, p.z);
}

// Nearer ones first, equal distances by y, x, z, so that the given order never matters.
inline bool is_before(double square_a, const Point& a, double square_b, const Point& b) {
    if (square_a != square_b) return square_a < square_b;
    if (a.y != b.y) return a.y < b.y;
    if (a.x != b.x) return a.x < b.x;
    return a.z < b.z;
}

// `squares` (count,) is working memory.
inline void sort_by_distance(Point* point, int count, double* squares) {
    for (int j = 0; j < count; ++j) {
        const Point own = point[j];
        const double own_square = square(own);
        int i = j;
        for (; i > 0 && is_before(own_square, own, squares[i - 1], point[i - 1]); --i) {
            point[i] = point[i - 1];
            squares[i] = squares[i - 1];
        }
        point[i] = own;
        squares[i] = own_square;
    }
}

inline void hold_at_contact(Point* point, int count) {
    for (int j = 0; j < count; ++j) {
        const double distance = std::sqrt(square(point[j]));
        if (distance < CONTACT) {
            const double scale = CONTACT / distance;
            point[j] = Point{scale * point[j].x, scale * point[j].y, scale * point[j].z};
        }
    }
}

// Lateral axes of the canonical frame: (F_x, F_z) = F'_x (xx, xz) + F'_z (zx, zz).
struct Axes {
    double xx, xz, zx, zz;
};

// Bring a sorted scene into the canonical frame of the symmetries of Stokes flow: inverted until
// neighbour 1 has y >= 0, turned until its azimuth about the flow axis is zero, mirrored until
// neighbour 2 has z >= 0. Where a coordinate is zero to rounding, the next neighbour decides.
inline Axes canonical_frame(Point* point, int count) {
    const double zero = 1e-9;
    double inversion = 1.0, cosine = 1.0, sine = 0.0, mirror = 1.0;
    const auto decides = [&](double coordinate, const Point& p) {
        return std::fabs(coordinate) > zero * std::sqrt(square(p));
    };
    for (int j = 0; j < count; ++j)
        if (decides(point[j].y, point[j])) {
            inversion = point[j].y > 0.0 ? 1.0 : -1.0;
            break;
        }
    for (int j = 0; j < count; ++j) {
        const Point& p = point[j];
        const double rho = std::sqrt(product(p.x, p.x) + product(p.z, p.z));
        if (decides(rho, p)) {
            cosine = inversion * p.x / rho;
            sine = inversion * p.z / rho;
            break;
        }
    }
    for (int j = 0; j < count; ++j) {
        const Point& p = point[j];
        const double z = inversion * (product(cosine, p.z) - product(sine, p.x));
        if (decides(z, p)) {
            mirror = z > 0.0 ? 1.0 : -1.0;
            break;
        }
    }
    for (int j = 0; j < count; ++j) {
        const double x = inversion * point[j].x, z = inversion * point[j].z;
        point[j].x = cosine * x + sine * z;
        point[j].y *= inversion;
        point[j].z = mirror * (cosine * z - sine * x);
    }
    return Axes{cosine, sine, -mirror * sine, mirror * cosine};
}

// Scenes that one pass through a network takes: two registers, so that each weight that is read
// serves both.
struct Batch {
    Lanes half[2];
};
const int BATCH = 2 * WIDTH;

// exp by its series on a small argument and repeated squaring: the library's tanh does not
// vectorise and would cost most of the time. The same polynomial as in the Python package.
inline Lanes bounded(Lanes value) {
    const double largest = 18.0;  // tanh of it is one to 5e-16
    const double series[] = {1.0 / 40320, 1.0 / 5040, 1.0 / 720, 1.0 / 120, 1.0 / 24,
                             1.0 / 6,     1.0 / 2,    1.0,       1.0};
    const int halvings = 4;
    const Lanes x = smaller(larger(value, lanes(-largest)), lanes(largest)) * (2.0 / 16.0);
    Lanes e = {};
    for (double coefficient : series) e = coefficient + x * e;
    for (int n = 0; n < halvings; ++n) e *= e;
    return 1.0 - 2.0 / (e + 1.0);
}

}  // namespace detail

// One block of a network. `widths` run from inputs over hidden layers to outputs; `parameters` hold
// each layer's weights (out, in) and, but for the last, its biases (out,).
struct Block {
    std::vector<int> widths;
    std::vector<double> parameters;
};

// What a block is given: the inputs of `number` neighbours from `first` on.
struct BlockInputs {
    int block, first, number;
};

struct Network {
    bool tanh;  // activation of the hidden layers, else ReLU
    double unit;
    std::vector<double> mean, scale;  // of the inputs of a neighbour
    std::vector<Block> blocks;
};

class ForceModel {
public:
    // Reads a model from a document: a class with `text(key)` (std::string), `number(key)`
    // (double), `numbers(key)` (std::vector<double>) and `child(key)` (a document), which throw
    // where there is no such entry.
    //
    // Throws std::invalid_argument, with a sentence, for a file of another format or version, for
    // one whose checksum or layout is wrong, and for one whose test scenes are not reproduced.
    template <class Document>
    explicit ForceModel(const Document& document) {
        Reading<Document> file(document);
        if (file.text("format") != FILE_FORMAT)
            refuse(std::string("holds no ") + FILE_FORMAT);
        const double version = file.number("version");
        if (version != FILE_VERSION) {
            std::ostringstream sentence;
            sentence << "has version " << version << ", and this reader knows " << FILE_VERSION;
            refuse(sentence.str());
        }
        name_ = file.text("model");
        hash_ = file.text("sha256");
        neighbours_ = whole(file.number("neighbours"), 1, 1000, "neighbours");
        sorted_ = choice(file.text("order"), "distance", "given", "order");
        canonical_ = choice(file.text("frame"), "canonical", "flow", "frame");
        unit_vectors_ = choice(file.text("inputs"), "unit_vectors", "spherical", "inputs");
        logarithm_ = choice(file.text("radial_input"), "logarithm", "distance", "radial_input");
        largest_ = file.number("largest_distance");
        envelope_power_ = whole(file.number("envelope_power"), 1, 10, "envelope_power");
        baseline_ = file.text("baseline");
        reflections_ = whole(file.number("reflections"), 0, 100, "reflections");
        correction_ = file.numbers("correction");
        const std::vector<double> all = file.numbers("block_inputs");
        if (all.size() % 3 != 0) refuse(OTHER_LAYOUT);
        int blocks = 0;
        for (std::size_t n = 0; n < all.size(); n += 3) {
            BlockInputs given;
            given.block = whole(all[n], 0, 100, "block_inputs");
            given.first = whole(all[n + 1], 0, neighbours_ - 1, "block_inputs");
            given.number = whole(all[n + 2], 1, neighbours_ - given.first, "block_inputs");
            block_inputs_.push_back(given);
            blocks = std::max(blocks, given.block + 1);
        }
        if (!block_inputs_.empty())
            for (int component = 0; component < 2; ++component)
                networks_.push_back(network(file, component, blocks));
        const std::vector<double> scenes = file.numbers("test_scenes");
        const std::vector<double> forces = file.numbers("test_forces");
        const double checksum = file.checksum();
        if (document.number("checksum") != checksum)
            refuse("is damaged: its numbers do not match its checksum");
        if (!(largest_ > 0.0) || correction_.size() % 2 != 0 || forces.empty() ||
            scenes.size() != neighbours_ * forces.size() ||
            (baseline_ != "isolated" && baseline_ != "stokeslets" && baseline_ != "mobility"))
            refuse(OTHER_LAYOUT);
        reproduce(scenes, forces);
    }

    const std::string& name() const { return name_; }
    const std::string& hash() const { return hash_; }  // SHA-256 of what the file holds
    int neighbours() const { return neighbours_; }     // that the model takes

    // Force (count, 3) on the reference sphere at the origin, for neighbours (count, N, 3) in the
    // frame of the flow, any order.
    //
    // A neighbour closer than contact is held at contact. Throws std::invalid_argument for a
    // neighbour that is not finite, or at the centre of the reference sphere.
    void predict(std::size_t count, const double* neighbours, double* force) const {
        check(count, neighbours);
        Work work(*this);
        for (std::size_t start = 0; start < count; start += detail::BATCH) {
            const std::size_t filled = std::min<std::size_t>(detail::BATCH, count - start);
            for (int lane = 0; lane < detail::BATCH; ++lane) {
                // The last batch is filled up with its last scene.
                const std::size_t scene = start + std::min<std::size_t>(lane, filled - 1);
                describe(neighbours + 3 * neighbours_ * scene, lane, work);
            }
            forces(work);
            for (std::size_t lane = 0; lane < filled; ++lane) {
                const int half = lane / detail::WIDTH, place = lane % detail::WIDTH;
                double* own = force + 3 * (start + lane);
                own[0] = work.force[half].x[place];
                own[1] = work.force[half].y[place];
                own[2] = work.force[half].z[place];
            }
        }
    }

    // Drag on particles that move relative to the fluid, in any frame: `drag = 3 pi mu d
    // (beta u + side)` for u = fluid velocity minus particle velocity.
    //
    // `flow` (count, 3) is u, any unit; `neighbours` (count, N, 3) run from each particle to its
    // neighbours, in d_p. Writes `beta` (count,), drag along u over that of an isolated sphere, and
    // `side` (count, 3) across it, in the unit of u. A particle at rest has no drag and no
    // direction; its beta is that of a flow along `at_rest` (3,). Throws as `predict`.
    void drag(std::size_t count, const double* flow, const double* neighbours,
              const double* at_rest, double* beta, double* side) const {
        std::vector<double> turned(3 * neighbours_ * count), force(3 * count);
        std::vector<std::array<double, 9>> rotation(count);
        for (std::size_t m = 0; m < count; ++m) {
            const double* u = flow + 3 * m;
            const bool rests = u[0] == 0.0 && u[1] == 0.0 && u[2] == 0.0;
            rotation[m] = rotation_to_streamwise(rests ? at_rest : u);
            for (int j = 0; j < neighbours_; ++j) {
                const double* r = neighbours + 3 * (neighbours_ * m + j);
                double* to = &turned[3 * (neighbours_ * m + j)];
                for (int k = 0; k < 3; ++k) {
                    const double* row = &rotation[m][3 * k];
                    to[k] = row[0] * r[0] + row[1] * r[1] + row[2] * r[2];
                }
            }
        }
        predict(count, turned.data(), force.data());
        for (std::size_t m = 0; m < count; ++m) {
            const double* u = flow + 3 * m;
            const double speed = std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
            beta[m] = force[3 * m + 1] / STOKES_DRAG;
            for (int k = 0; k < 3; ++k)
                side[3 * m + k] = speed / STOKES_DRAG * (rotation[m][k] * force[3 * m] +
                                                         rotation[m][6 + k] * force[3 * m + 2]);
        }
    }

    // The smallest rotation R, row by row, that turns a velocity into the streamwise direction +y
    // (Rodrigues). Exactly against it, where that is not unique, the half turn about z; of a zero
    // velocity the identity.
    static std::array<double, 9> rotation_to_streamwise(const double* velocity) {
        double x = velocity[0], c = velocity[1], z = velocity[2];
        // Scaling first keeps the squares of very small and very large velocities in range.
        const double scale = std::max(std::fabs(x), std::max(std::fabs(c), std::fabs(z)));
        if (scale == 0.0) {
            c = 1.0;
        } else {
            x /= scale, c /= scale, z /= scale;
            const double length = std::sqrt(x * x + c * c + z * z);
            x /= length, c /= length, z /= length;
        }
        double q, a = x, b = z;
        if (c > -0.5) {
            q = 1.0 / (1.0 + c);
        } else {
            // 1 + c cancels near the antiparallel direction; there (1 - c) (x, z)/|(x, z)| is exact.
            const double s = std::max(std::fabs(x), std::fabs(z));
            a = s > 0.0 ? x / s : 1.0;
            b = s > 0.0 ? z / s : 0.0;
            q = (1.0 - c) / (a * a + b * b);
        }
        const double xx = q * a * a, zz = q * b * b, xz = q * a * b;
        return {{c + zz, -x, -xz, x, c, z, -xz, -z, c + xx}};
    }

private:
    static constexpr const char* OTHER_LAYOUT = "has another layout than its reader";

    // Passes on what a document holds, and adds it up to a CRC-32 in the order of reading: texts
    // by their bytes, numbers as little-endian doubles.
    template <class Document>
    class Reading {
    public:
        explicit Reading(const Document& document) : document_(document), sum_(&own_sum_) {}
        std::string text(const char* key) {
            const std::string value = document_.text(key);
            add(value.data(), value.size());
            return value;
        }
        double number(const char* key) { return added({document_.number(key)})[0]; }
        std::vector<double> numbers(const char* key) { return added(document_.numbers(key)); }
        Reading child(const char* key) { return Reading(document_.child(key), sum_); }
        double checksum() const { return ~*sum_ & 0xffffffffu; }

    private:
        Document document_;
        std::uint32_t own_sum_ = 0xffffffffu;
        std::uint32_t* sum_;

        Reading(const Document& document, std::uint32_t* sum) : document_(document), sum_(sum) {}
        std::vector<double> added(std::vector<double> values) {
            for (const double value : values) {
                if (!std::isfinite(value)) refuse("holds a number that is not finite");
                std::uint64_t bits;
                std::memcpy(&bits, &value, sizeof bits);
                char bytes[8];
                for (int n = 0; n < 8; ++n) bytes[n] = static_cast<char>(bits >> 8 * n);
                add(bytes, sizeof bytes);
            }
            return values;
        }
        void add(const char* bytes, std::size_t count) {
            for (std::size_t n = 0; n < count; ++n) {
                *sum_ ^= static_cast<unsigned char>(bytes[n]);
                for (int bit = 0; bit < 8; ++bit)
                    *sum_ = *sum_ >> 1 ^ (*sum_ & 1 ? 0xedb88320u : 0);
            }
        }
    };

    // What a batch of scenes is, and what becomes of it.
    struct Work {
        detail::Scratch<detail::Vector> neighbour;  // (2, N), held at contact, flow frame
        detail::Scratch<detail::Batch> input;       // (N, F)
        detail::Scratch<detail::Batch> envelope;    // (block inputs,)
        detail::Scratch<detail::Batch> layer, following;
        detail::Scratch<detail::Batch> axes;        // xx, xz, zx, zz
        detail::Vector force[2];
        std::vector<detail::Point> scene;
        std::vector<double> squares;
        detail::HeldSpheres spheres;

        explicit Work(const ForceModel& model)
            : neighbour(2 * model.neighbours_),
              input(model.neighbours_ * model.features()),
              envelope(model.block_inputs_.size()),
              layer(model.widest()),
              following(model.widest()),
              axes(4),
              scene(model.neighbours_),
              squares(model.neighbours_),
              spheres(model.neighbours_, model.reflections_, model.correction_) {}
    };

    std::string name_, hash_, baseline_;
    int neighbours_, envelope_power_, reflections_;
    bool sorted_, canonical_, unit_vectors_, logarithm_;
    double largest_;
    std::vector<double> correction_;
    std::vector<BlockInputs> block_inputs_;
    std::vector<Network> networks_;  // streamwise, lateral; none for a closed formula

    [[noreturn]] static void refuse(const std::string& reason) {
        throw std::invalid_argument("the force model's file " + reason);
    }

    static int whole(double value, int least, int most, const char* key) {
        if (!(value >= least && value <= most && value == std::floor(value))) {
            std::ostringstream sentence;
            sentence << "has " << key << " " << value << ": whole numbers from " << least << " to "
                     << most << " are allowed";
            refuse(sentence.str());
        }
        return static_cast<int>(value);
    }

    static bool choice(const std::string& value, const char* yes, const char* no, const char* key) {
        if (value != yes && value != no)
            refuse(std::string("has ") + key + " " + value + ": " + yes + " or " + no +
                   " are allowed");
        return value == yes;
    }

    // Numbers that the networks see of a neighbour: 1/r, log r, unit vector; else spherical.
    int features() const { return unit_vectors_ ? 5 : 3; }

    int widest() const {
        int result = 1;
        for (const Network& network : networks_)
            for (const Block& block : network.blocks)
                for (int width : block.widths) result = std::max(result, width);
        return result;
    }

    template <class Document>
    Network network(Reading<Document>& file, int component, int blocks) const {
        Reading<Document> from = file.child(component == 0 ? "streamwise" : "lateral");
        Network network;
        network.tanh = choice(from.text("activation"), "tanh", "relu", "activation");
        network.unit = from.number("unit");
        network.mean = from.numbers("mean");
        network.scale = from.numbers("scale");
        const std::size_t wanted = features();
        bool fits = network.mean.size() == wanted && network.scale.size() == wanted;
        for (double scale : network.scale) fits = fits && scale != 0.0;
        for (int number = 0; number < blocks; ++number) {
            std::ostringstream key;
            key << "block" << number;
            Reading<Document> entry = from.child(key.str().c_str());
            Block block;
            for (double width : entry.numbers("widths"))
                block.widths.push_back(whole(width, 1, 10000, "widths"));
            block.parameters = entry.numbers("parameters");
            const std::vector<int>& widths = block.widths;
            std::size_t parameters = 0;
            for (std::size_t n = 0; n + 1 < widths.size(); ++n)
                parameters += static_cast<std::size_t>(widths[n + 1]) *
                              (widths[n] + (n + 2 < widths.size() ? 1 : 0));
            fits = fits && widths.size() >= 2 && block.parameters.size() == parameters &&
                   widths.back() == component + 1;
            for (const BlockInputs& given : block_inputs_)
                fits = fits && (given.block != number || widths.empty() ||
                                widths[0] == given.number * features());
            network.blocks.push_back(block);
        }
        if (!fits) refuse("is damaged: its networks do not have the layout that it states");
        return network;
    }

    void reproduce(const std::vector<double>& scenes, const std::vector<double>& forces) const {
        std::vector<double> predicted(forces.size());
        predict(forces.size() / 3, scenes.data(), predicted.data());
        for (std::size_t n = 0; n < forces.size(); ++n) {
            if (std::fabs(predicted[n] - forces[n]) <= TEST_TOLERANCE) continue;
            std::ostringstream sentence;
            sentence << "has a test scene, number " << n / 3 << ", with the force " << forces[n]
                     << ", but here it has " << predicted[n];
            refuse(sentence.str());
        }
    }

    void check(std::size_t count, const double* neighbours) const {
        for (std::size_t n = 0; n < count * neighbours_; ++n) {
            const double *r = neighbours + 3 * n, sum = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
            if (sum > 0.0 && sum <= std::numeric_limits<double>::max()) continue;
            std::ostringstream sentence;
            sentence << "neighbour " << n % neighbours_ << " of scene " << n / neighbours_ << " is "
                     << (sum == 0.0 ? "at the centre of the reference sphere"
                                    : "not at a finite distance");
            throw std::invalid_argument(sentence.str());
        }
    }

    void describe(const double* neighbours, int lane, Work& work) const {
        const int half = lane / detail::WIDTH, place = lane % detail::WIDTH;
        detail::Point* scene = work.scene.data();
        for (int j = 0; j < neighbours_; ++j)
            scene[j] = detail::Point{neighbours[3 * j], neighbours[3 * j + 1], neighbours[3 * j + 2]};
        if (sorted_) detail::sort_by_distance(scene, neighbours_, work.squares.data());
        detail::hold_at_contact(scene, neighbours_);
        for (int j = 0; j < neighbours_; ++j) {
            detail::Vector& r = work.neighbour[half * neighbours_ + j];
            r.x[place] = scene[j].x, r.y[place] = scene[j].y, r.z[place] = scene[j].z;
        }
        if (networks_.empty()) return;
        if (canonical_) {
            const detail::Axes axes = detail::canonical_frame(scene, neighbours_);
            work.axes[0].half[half][place] = axes.xx;
            work.axes[1].half[half][place] = axes.xz;
            work.axes[2].half[half][place] = axes.zx;
            work.axes[3].half[half][place] = axes.zz;
        }
        const auto input = [&](int j, int k) -> detail::Lanes& {
            return work.input[j * features() + k].half[half];
        };
        double nearest = std::numeric_limits<double>::max();
        for (int j = 0; j < neighbours_; ++j) {
            const detail::Point& r = scene[j];
            const double distance = std::sqrt(r.x * r.x + r.y * r.y + r.z * r.z);
            const double seen = std::min(distance, largest_);
            nearest = std::min(nearest, distance);
            if (unit_vectors_) {
                input(j, 0)[place] = CONTACT / distance;
                input(j, 1)[place] = std::log(seen);
                input(j, 2)[place] = r.x / distance;
                input(j, 3)[place] = r.y / distance;
                input(j, 4)[place] = r.z / distance;
            } else {
                input(j, 0)[place] = logarithm_ ? std::log(seen) : seen;
                input(j, 1)[place] = std::atan2(r.y, r.x);
                input(j, 2)[place] = std::atan2(std::sqrt(r.x * r.x + r.y * r.y), r.z);
            }
        }
        for (std::size_t n = 0; n < block_inputs_.size(); ++n) {
            double weight = std::min(1.0, largest_ / nearest);
            if (unit_vectors_) {
                const double inverse = input(block_inputs_[n].first, 0)[place];
                weight = 1.0;
                for (int power = 0; power < envelope_power_; ++power) weight *= inverse;
            }
            work.envelope[n].half[half][place] = weight;
        }
    }

    void forces(Work& work) const {
        for (int half = 0; half < 2; ++half)
            work.force[half] = baseline(&work.neighbour[half * neighbours_], work);
        if (networks_.empty()) return;
        detail::Batch streamwise, lateral[2];
        evaluate(networks_[0], 1, work, &streamwise);
        evaluate(networks_[1], 2, work, lateral);
        for (int half = 0; half < 2; ++half) {
            detail::Vector& force = work.force[half];
            const detail::Lanes x = lateral[0].half[half], z = lateral[1].half[half];
            force.y += streamwise.half[half];
            if (canonical_) {
                force.x += x * work.axes[0].half[half] + z * work.axes[2].half[half];
                force.z += x * work.axes[1].half[half] + z * work.axes[3].half[half];
            } else {
                force.x += x;
                force.z += z;
            }
        }
    }

    detail::Vector baseline(const detail::Vector* neighbour, Work& work) const {
        using namespace detail;
        const Lanes drag = lanes(STOKES_DRAG);
        if (baseline_ == "mobility") return drag * work.spheres.force(neighbour);
        Vector force = {Lanes{}, lanes(1.0), Lanes{}};
        if (baseline_ == "stokeslets")
            // Each neighbour drags the fluid as a point force of Stokes drag.
            for (int j = 0; j < neighbours_; ++j) {
                const Vector& r = neighbour[j];
                const Lanes distance = root(dot(r, r));
                const Lanes along = 0.375 * r.y / (distance * distance * distance);
                force = force - along * r;
                force.y -= 0.375 / distance;
            }
        return drag * force;
    }

    // What a network adds to the baseline, (outputs,) [Re_p c_D].
    void evaluate(const Network& network, int outputs, Work& work, detail::Batch* result) const {
        using namespace detail;
        for (int o = 0; o < outputs; ++o) result[o] = Batch{};
        for (std::size_t n = 0; n < block_inputs_.size(); ++n) {
            const BlockInputs& given = block_inputs_[n];
            const Block& block = network.blocks[given.block];
            Batch *layer = work.layer.data(), *following = work.following.data();
            for (int j = 0; j < given.number; ++j)
                for (int k = 0; k < features(); ++k)
                    for (int half = 0; half < 2; ++half)
                        layer[j * features() + k].half[half] =
                            (work.input[(given.first + j) * features() + k].half[half] -
                             network.mean[k]) / network.scale[k];
            const double* weights = block.parameters.data();
            for (std::size_t depth = 0; depth + 1 < block.widths.size(); ++depth) {
                const int wide = block.widths[depth], narrow = block.widths[depth + 1];
                multiply(weights, wide, narrow, layer, following);
                weights += wide * narrow;
                std::swap(layer, following);
                if (depth + 2 == block.widths.size()) break;
                for (int o = 0; o < narrow; ++o)
                    for (int half = 0; half < 2; ++half) {
                        Lanes& value = layer[o].half[half];
                        value += weights[o];
                        value = network.tanh ? bounded(value) : larger(value, Lanes{});
                    }
                weights += narrow;
            }
            for (int o = 0; o < outputs; ++o)
                for (int half = 0; half < 2; ++half)
                    result[o].half[half] += work.envelope[n].half[half] * layer[o].half[half];
        }
        for (int o = 0; o < outputs; ++o)
            for (int half = 0; half < 2; ++half) result[o].half[half] *= network.unit;
    }

    // following = weights layer, TILE rows at a time, whose sums stay in registers.
    static void multiply(const double* weights, int wide, int narrow, const detail::Batch* layer,
                         detail::Batch* following) {
        using namespace detail;
        const int TILE = 4;
        int o = 0;
        for (; o + TILE <= narrow; o += TILE) {
            const double* row = weights + o * wide;
            Batch sum[TILE] = {};
            for (int k = 0; k < wide; ++k)
                for (int t = 0; t < TILE; ++t)
                    for (int half = 0; half < 2; ++half)
                        sum[t].half[half] += row[t * wide + k] * layer[k].half[half];
            for (int t = 0; t < TILE; ++t) following[o + t] = sum[t];
        }
        for (; o < narrow; ++o) {
            Batch sum = {};
            for (int k = 0; k < wide; ++k)
                for (int half = 0; half < 2; ++half)
                    sum.half[half] += weights[o * wide + k] * layer[k].half[half];
            following[o] = sum;
        }
    }
};

}  // namespace dustfall

#endif
