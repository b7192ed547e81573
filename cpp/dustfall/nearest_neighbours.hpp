// The nearest neighbours of points, exactly, with periodic images along any of the three axes.
//
// Plain C++11, no library needed. Every other point counts once, at its nearest image. What a
// search returns depends on positions and keys alone, not on the order of the points: distances are
// computed in one way everywhere, and where two are equal the point with the lower key comes first.

#ifndef DUSTFALL_NEAREST_NEIGHBOURS_HPP
#define DUSTFALL_NEAREST_NEIGHBOURS_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace dustfall {

class NearestNeighbours {
public:
    struct Neighbour {
        double square;     // of the distance
        std::size_t point;  // its number among the points
    };

    static const std::size_t NONE = static_cast<std::size_t>(-1);

    // Points (count, 3), wrapped or not, their keys (count,), all different, and the period along
    // each axis, zero where there is none.
    //
    // Throws std::invalid_argument for a position or period that is not finite, or a negative
    // period.
    NearestNeighbours(std::size_t count, const double* positions, const std::int64_t* keys,
                      const double* period)
        : count_(count), key_(keys, keys + count), wrapped_(3 * count) {
        for (int axis = 0; axis < 3; ++axis) set_axis(axis, positions, period[axis]);
        choose_cells();
        sort_by_cell();
    }

    std::size_t count() const { return count_; }

    // The points in the order of their cells: who searches in this order finds memory warm.
    const std::vector<std::size_t>& order() const { return point_; }

    // The `number` points nearest to the point `own`, itself left out, nearest first. Writes to
    // `found` (number,) and returns how many there are: fewer only where there are fewer points.
    int find(std::size_t own, int number, Neighbour* found) const {
        return search(&wrapped_[3 * own], own, number, found);
    }

    // The same of any place (3,); no point is left out.
    int find_near(const double* place, int number, Neighbour* found) const {
        double wrapped[3];
        for (int axis = 0; axis < 3; ++axis) wrapped[axis] = wrap(axis, place[axis]);
        return search(wrapped, NONE, number, found);
    }

    // Vector from a point to the nearest image of another.
    void separation(std::size_t from, std::size_t to, double* vector) const {
        separation(&wrapped_[3 * from], to, vector);
    }

    // Vector from any place to the nearest image of a point.
    void separation_from(const double* place, std::size_t to, double* vector) const {
        double wrapped[3];
        for (int axis = 0; axis < 3; ++axis) wrapped[axis] = wrap(axis, place[axis]);
        separation(wrapped, to, vector);
    }

private:
    struct Axis {
        double period, half;          // zero and infinity without images
        double origin, extent;        // of the cells
        double scale;                 // cells over extent
        std::ptrdiff_t cells;
    };

    std::size_t count_;
    std::vector<std::int64_t> key_;
    std::vector<double> wrapped_;  // (count, 3)
    Axis axes_[3];
    std::vector<std::size_t> point_;              // in the order of their cells
    std::vector<double> sorted_[3];               // coordinates in that order
    std::vector<std::size_t> first_;              // of each cell in that order

    void set_axis(int number, const double* positions, double period) {
        if (!(period >= 0.0 && period <= std::numeric_limits<double>::max())) {
            std::ostringstream sentence;
            sentence << "the period along axis " << number << " is " << period
                     << ": it has to be finite, positive, or zero where there is none";
            throw std::invalid_argument(sentence.str());
        }
        Axis& axis = axes_[number];
        axis.period = period;
        axis.half = period > 0.0 ? 0.5 * period : std::numeric_limits<double>::infinity();
        double low = std::numeric_limits<double>::max(), high = -low;
        for (std::size_t i = 0; i < count_; ++i) {
            const double x = positions[3 * i + number];
            if (!(std::fabs(x) <= std::numeric_limits<double>::max())) {
                std::ostringstream sentence;
                sentence << "coordinate " << number << " of point " << i << " is not finite";
                throw std::invalid_argument(sentence.str());
            }
            wrapped_[3 * i + number] = wrap(number, x);
            low = std::min(low, x);
            high = std::max(high, x);
        }
        axis.origin = period > 0.0 || count_ == 0 ? 0.0 : low;
        axis.extent = period > 0.0 ? period : count_ == 0 ? 0.0 : high - low;
    }

    // Folded into the period, 0 <= x < period.
    double wrap(int number, double x) const {
        const double period = axes_[number].period;
        if (period == 0.0) return x;
        const double wrapped = x - period * std::floor(x / period);
        // A tiny negative coordinate wraps onto the far face by rounding.
        return wrapped < period ? wrapped : 0.0;
    }

    // Cubic cells of two points on average; an axis shorter than a cell has one.
    void choose_cells() {
        const double points_a_cell = 2.0;
        bool divided[3];
        for (int axis = 0; axis < 3; ++axis) divided[axis] = axes_[axis].extent > 0.0;
        double width = 0.0;
        for (bool changed = true; changed;) {
            changed = false;
            double volume = points_a_cell / std::max<double>(1.0, count_);
            int dimensions = 0;
            for (int axis = 0; axis < 3; ++axis)
                if (divided[axis]) volume *= axes_[axis].extent, ++dimensions;
            width = dimensions > 0 ? std::pow(volume, 1.0 / dimensions) : 0.0;
            for (int axis = 0; axis < 3; ++axis)
                if (divided[axis] && axes_[axis].extent < width) {
                    divided[axis] = false;
                    changed = true;
                }
        }
        for (int axis = 0; axis < 3; ++axis) {
            Axis& own = axes_[axis];
            own.cells = divided[axis] ? static_cast<std::ptrdiff_t>(own.extent / width) : 1;
            own.scale = own.extent > 0.0 ? own.cells / own.extent : 0.0;
        }
    }

    std::ptrdiff_t cell_along(int axis, double x) const {
        const Axis& own = axes_[axis];
        const double cell = (x - own.origin) * own.scale;
        return static_cast<std::ptrdiff_t>(std::min(std::max(cell, 0.0), own.cells - 1.0));
    }

    void sort_by_cell() {
        first_.assign(axes_[0].cells * axes_[1].cells * axes_[2].cells + 1, 0);
        std::vector<std::size_t> cell(count_);
        for (std::size_t i = 0; i < count_; ++i) {
            std::ptrdiff_t number = 0;
            for (int axis = 0; axis < 3; ++axis)
                number = number * axes_[axis].cells + cell_along(axis, wrapped_[3 * i + axis]);
            cell[i] = number;
            ++first_[number + 1];
        }
        for (std::size_t number = 1; number < first_.size(); ++number)
            first_[number] += first_[number - 1];
        point_.resize(count_);
        for (int axis = 0; axis < 3; ++axis) sorted_[axis].resize(count_);
        std::vector<std::size_t> place(first_.begin(), first_.end() - 1);
        for (std::size_t i = 0; i < count_; ++i) {
            const std::size_t k = place[cell[i]]++;
            point_[k] = i;
            for (int axis = 0; axis < 3; ++axis) sorted_[axis][k] = wrapped_[3 * i + axis];
        }
    }

    // A difference of two wrapped coordinates, taken to the nearest image.
    static double nearest_image(double difference, const Axis& axis) {
        const double down = difference > axis.half ? axis.period : 0.0;
        const double up = difference < -axis.half ? axis.period : 0.0;
        return difference - down + up;
    }

    void separation(const double* wrapped, std::size_t to, double* vector) const {
        for (int axis = 0; axis < 3; ++axis)
            vector[axis] = nearest_image(wrapped_[3 * to + axis] - wrapped[axis], axes_[axis]);
    }

    bool is_before(const Neighbour& a, const Neighbour& b) const {
        return a.square < b.square || (a.square == b.square && key_[a.point] < key_[b.point]);
    }

    // Takes cells around a wrapped place, one layer more at a time, until enough points are found
    // nearer than any outside these cells.
    int search(const double* place, std::size_t own, int number, Neighbour* found) const {
        std::ptrdiff_t centre[3];
        for (int axis = 0; axis < 3; ++axis) centre[axis] = cell_along(axis, place[axis]);
        for (std::ptrdiff_t reach = 1;; ++reach) {
            std::ptrdiff_t low[3], high[3];
            double bound = std::numeric_limits<double>::infinity();
            for (int axis = 0; axis < 3; ++axis)
                bound = std::min(
                    bound, cover(axis, place[axis], centre[axis], reach, low[axis], high[axis]));
            const bool all = bound == std::numeric_limits<double>::infinity();
            if (bound <= 0.0) continue;
            const int met = scan(place, own, low, high, all ? bound : bound * bound, number, found);
            if (all || met == number) return met;
        }
    }

    // The cells of an axis within `reach` of a cell, and how far away any point outside them is.
    double cover(int number, double x, std::ptrdiff_t centre, std::ptrdiff_t reach,
                 std::ptrdiff_t& low, std::ptrdiff_t& high) const {
        const double rounding = 1e-9;  // of a cell: points on a face may be on either side of it
        const Axis& axis = axes_[number];
        const double infinity = std::numeric_limits<double>::infinity();
        low = centre - reach;
        high = centre + reach;
        const bool whole = high - low + 1 >= axis.cells;
        double below = infinity, above = infinity;
        if (axis.period > 0.0 ? !whole : low > 0)
            below = (x - axis.origin) - (low + rounding) / axis.scale;
        if (axis.period > 0.0 ? !whole : high < axis.cells - 1)
            above = (high + 1 - rounding) / axis.scale - (x - axis.origin);
        if (axis.period > 0.0 ? whole : low < 0) low = 0;
        if (axis.period > 0.0 ? whole : high > axis.cells - 1) high = axis.cells - 1;
        return std::min(below, above);
    }

    // The nearest points of these cells, as far as the squares of their distances are below `limit`.
    int scan(const double* place, std::size_t own, const std::ptrdiff_t* low,
             const std::ptrdiff_t* high, double limit, int number, Neighbour* found) const {
        // Where the cells are all of a period, each point has its own nearest image; elsewhere all
        // points of a cell have the same, and those for which it is not are beyond the limit.
        bool images = false;
        for (int axis = 0; axis < 3; ++axis)
            images = images || (axes_[axis].period > 0.0 && high[axis] - low[axis] + 1 ==
                                                                axes_[axis].cells);
        int met = 0;
        double shift[3];
        for (std::ptrdiff_t x = low[0]; x <= high[0]; ++x)
            for (std::ptrdiff_t y = low[1]; y <= high[1]; ++y) {
                const std::ptrdiff_t row = fold(0, x, shift) * axes_[1].cells;
                const std::ptrdiff_t column =
                    (row + fold(1, y, shift)) * axes_[2].cells;
                // Cells that follow each other along the last axis do so in memory: one run, or two
                // where they meet a face.
                for (std::ptrdiff_t z = low[2]; z <= high[2];) {
                    const std::ptrdiff_t begin = fold(2, z, shift);
                    const std::ptrdiff_t length =
                        std::min(high[2] - z, axes_[2].cells - 1 - begin) + 1;
                    const std::size_t first = first_[column + begin];
                    const std::size_t end = first_[column + begin + length];
                    met = images
                              ? scan_run<true>(first, end, place, shift, own, limit, number, found, met)
                              : scan_run<false>(first, end, place, shift, own, limit, number, found, met);
                    z += length;
                }
            }
        return met;
    }

    // The cell that a cell beyond a face is an image of, and the shift from that cell to it.
    std::ptrdiff_t fold(int number, std::ptrdiff_t cell, double* shift) const {
        const Axis& axis = axes_[number];
        const std::ptrdiff_t periods = cell < 0 ? -1 : cell >= axis.cells ? 1 : 0;
        shift[number] = periods * axis.period;
        return cell - periods * axis.cells;
    }

    template <bool IMAGES>
    int scan_run(std::size_t begin, std::size_t end, const double* place, const double* shift,
                 std::size_t own, double limit, int number, Neighbour* found, int met) const {
        const std::size_t chunk = 16;
        double square[chunk];
        std::size_t kept[chunk];
        const double px = place[0], py = place[1], pz = place[2];
        const double sx = shift[0], sy = shift[1], sz = shift[2];
        for (; begin < end; begin += chunk) {
            const std::size_t length = std::min(chunk, end - begin);
            const double *x = &sorted_[0][begin], *y = &sorted_[1][begin], *z = &sorted_[2][begin];
            for (std::size_t k = 0; k < length; ++k) {
                double dx = x[k] - px + sx, dy = y[k] - py + sy, dz = z[k] - pz + sz;
                if (IMAGES) {
                    dx = nearest_image(dx, axes_[0]);
                    dy = nearest_image(dy, axes_[1]);
                    dz = nearest_image(dz, axes_[2]);
                }
                square[k] = dx * dx + dy * dy + dz * dz;
            }
            // Few pass, which ones no processor guesses: so none is asked to.
            std::size_t count = 0;
            for (std::size_t k = 0; k < length; ++k) {
                kept[count] = k;
                count += square[k] < limit;
            }
            for (std::size_t k = 0; k < count; ++k) {
                const Neighbour candidate = {square[kept[k]], point_[begin + kept[k]]};
                if (candidate.point == own) continue;
                if (met == number && !is_before(candidate, found[number - 1])) continue;
                int slot = met < number ? met++ : number - 1;
                for (; slot > 0 && is_before(candidate, found[slot - 1]); --slot)
                    found[slot] = found[slot - 1];
                found[slot] = candidate;
            }
        }
        return met;
    }
};

}  // namespace dustfall

#endif
