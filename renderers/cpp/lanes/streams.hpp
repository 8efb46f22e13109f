// VEC-1: streams of rays and of hits, and what a thread has of them.
#pragma once
#include "scene.hpp"

// Records in columns, of which some lanes are added and whole vectors are read. A record has columns(record, use),
// which calls use(column) for each of its vectors.
template<typename Real, typename Record>
class Stream {
public:
    int count = 0;

    // Of a stream without any.
    void make_room(int records)
    {
        if (room == 0) {
            room = records;
            pitch = std::size_t(records) + std::size_t(lane_count<Real>);
            numbers.resize(pitch * std::size_t(Record::column_count));
        }
    }

    int left() const { return room - count; }

    LANE void add(Mask<Real> wanted, const Record& record)
    {
        Real* to = numbers.data() + count;
        Record::columns(record, [&](const auto& column) {
            compress<Real>(wanted, Lanes<Real>(column), to);
            to += pitch;
        });
        count += ::count<Real>(wanted);
    }

    LANE Record at(int first) const
    {
        Record record;
        const Real* from = numbers.data() + first;
        Record::columns(record, [&](auto& column) {
            column = std::remove_reference_t<decltype(column)>(load(from));
            from += pitch;
        });
        return record;
    }

private:
    int room = 0;
    std::size_t pitch = 0;
    std::vector<Real> numbers;
};

// What a ray has besides its line. pixel: the place of its sample in the tile.
template<typename Real>
struct LaneBranch {
    static constexpr int column_count = (needs::attenuation ? 3 : 1) + 1 + needs::media + needs::random;

    std::conditional_t<needs::attenuation, Vec3<Lanes<Real>>, Lanes<Real>> weight;
    Integers<Real> pixel;
    [[no_unique_address]] LaneInside<Real> inside;
    [[no_unique_address]] Only<needs::random, Integers<Real>, 'p'> path;

    template<typename Self, typename Use>
    LANE static void columns(Self& self, const Use& use)
    {
        if constexpr (needs::attenuation)
            use(self.weight.x), use(self.weight.y), use(self.weight.z);
        else
            use(self.weight);
        use(self.pixel);
        if constexpr (needs::media)
            use(self.inside);
        if constexpr (needs::random)
            use(self.path);
    }
};

template<typename Real>
struct LaneRay {
    static constexpr int column_count = 6 + LaneBranch<Real>::column_count;

    Vec3<Lanes<Real>> origin, direction;
    LaneBranch<Real> branch;

    template<typename Self, typename Use>
    LANE static void columns(Self& self, const Use& use)
    {
        use(self.origin.x), use(self.origin.y), use(self.origin.z);
        use(self.direction.x), use(self.direction.y), use(self.direction.z);
        LaneBranch<Real>::columns(self.branch, use);
    }
};

// point: on the ray. t: its length.
template<typename Real>
struct LaneRayHit {
    static constexpr int column_count = 7 + needs::attenuation + LaneBranch<Real>::column_count;

    Vec3<Lanes<Real>> point, direction;
    Integers<Real> face;
    [[no_unique_address]] Only<needs::attenuation, Lanes<Real>, 't'> t;
    LaneBranch<Real> branch;

    template<typename Self, typename Use>
    LANE static void columns(Self& self, const Use& use)
    {
        use(self.point.x), use(self.point.y), use(self.point.z);
        use(self.direction.x), use(self.direction.y), use(self.direction.z);
        use(self.face);
        if constexpr (needs::attenuation)
            use(self.t);
        LaneBranch<Real>::columns(self.branch, use);
    }
};

// Rays of one order, and their hits by form.
template<typename Real>
struct LaneOrder {
    Stream<Real, LaneRay<Real>> rays;
    Stream<Real, LaneRayHit<Real>> hits[forms];
};

// What a thread has of its own. A tile has as many samples as there is room for.
template<typename Real>
struct alignas(128) LaneWorker {
    LaneDesk<Real> desk;
    std::vector<LaneOrder<Real>> orders;
    LaneShapes<Real> ahead;        // of the tile's eye rays
    std::vector<Real> colours[3];  // of samples
    [[no_unique_address]] List<needs::cutoff, Real, 'w'> dropped;           // CUT-2
    [[no_unique_address]] List<needs::random, std::uint32_t, 'n'> numbers;  // of the samples' pixels (RND-3)
    std::uint32_t sample = 0;
    int order = 0;  // of the rays that are shaded
};
