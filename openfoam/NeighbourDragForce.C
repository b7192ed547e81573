#include "NeighbourDragForce.H"

#include "IFstream.H"
#include "OSspecific.H"
#include "coupledPolyPatch.H"
#include "cpuTime.H"
#include "interpolation.H"
#include "mathematicalConstants.H"

// * * * * * * * * * * * * * * * Local Classes * * * * * * * * * * * * * * * //

namespace Foam
{

//- A dictionary as dustfall::ForceModel reads it
class modelDocument
{
    const dictionary& dict_;

public:

    explicit modelDocument(const dictionary& dict)
    :
        dict_(dict)
    {}

    std::string text(const char* key) const
    {
        return string(dict_.lookup(key));
    }

    double number(const char* key) const
    {
        return readScalar(dict_.lookup(key));
    }

    std::vector<double> numbers(const char* key) const
    {
        const scalarList values(dict_.lookup(key));
        return std::vector<double>(values.begin(), values.end());
    }

    modelDocument child(const char* key) const
    {
        return modelDocument(dict_.subDict(key));
    }
};

//- Where the two lines of OpenFOAM differ: that of www.openfoam.com defines OPENFOAM, that of
//- openfoam.org does not
#ifdef OPENFOAM
template<class ParcelType>
vector position(const ParcelType& p, const polyMesh&)
{
    return p.position();
}

template<class ParcelType>
tetIndices tetOf(const ParcelType& p, const polyMesh&)
{
    return p.currentTetIndices();
}

inline bool turns(const coupledPolyPatch& patch)
{
    return !patch.parallel();
}

inline vector translation(const coupledPolyPatch& patch)
{
    return patch.separated() ? patch.separation()[0] : vector(Zero);
}
#else
template<class ParcelType>
vector position(const ParcelType& p, const polyMesh& mesh)
{
    return p.position(mesh);
}

template<class ParcelType>
tetIndices tetOf(const ParcelType& p, const polyMesh& mesh)
{
    return p.currentTetIndices(mesh);
}

inline bool turns(const coupledPolyPatch& patch)
{
    return patch.transform().transforms();
}

inline vector translation(const coupledPolyPatch& patch)
{
    return patch.transform().t();
}
#endif

} // End namespace Foam


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

template<class CloudType>
int64_t Foam::NeighbourDragForce<CloudType>::key
(
    const typename CloudType::parcelType& p
)
{
    return int64_t(p.origProc()) << 40 | int64_t(p.origId());
}


template<class CloudType>
Foam::vector Foam::NeighbourDragForce<CloudType>::meshPeriod() const
{
    // The least is kept beside the largest: two pairs of patches may disagree.
    vector largest = Zero;
    vector least = vector::uniform(VGREAT);
    bool rotated = false;
    bool oblique = false;

    forAll(this->mesh().boundaryMesh(), patchi)
    {
        const polyPatch& patch = this->mesh().boundaryMesh()[patchi];

        // A patch may have all its faces on other processors.
        if (!isA<coupledPolyPatch>(patch) || patch.empty())
        {
            continue;
        }
        const coupledPolyPatch& coupled = refCast<const coupledPolyPatch>(patch);
        rotated = rotated || turns(coupled);
        const vector separation = cmptMag(translation(coupled));
        label axes = 0;
        for (direction axis = 0; axis < vector::nComponents; ++axis)
        {
            if (separation[axis] > SMALL*mag(separation))
            {
                ++axes;
                largest[axis] = max(largest[axis], separation[axis]);
                least[axis] = min(least[axis], separation[axis]);
            }
        }
        oblique = oblique || axes > 1;
    }
    reduce(largest, maxOp<vector>());
    reduce(least, minOp<vector>());
    reduce(rotated, orOp<bool>());
    reduce(oblique, orOp<bool>());

    if (rotated)
    {
        FatalErrorInFunction
            << "Cyclic patches turn the flow: neighbours are found with images that are"
            << " translations only" << exit(FatalError);
    }
    for (direction axis = 0; axis < vector::nComponents; ++axis)
    {
        oblique =
            oblique
         || (largest[axis] > 0 && largest[axis] - least[axis] > 1e-6*largest[axis]);
    }
    if (oblique)
    {
        FatalErrorInFunction
            << "Cyclic patches are not a period along x, y or z, one for each: neighbours are"
            << " found with such images only" << exit(FatalError);
    }
    return largest;
}


template<class CloudType>
void Foam::NeighbourDragForce<CloudType>::checkParcels()
{
    scalar least = VGREAT;
    scalar largest = 0;
    bool single = true;
    for (const typename CloudType::parcelType& p : this->owner())
    {
        least = min(least, p.d());
        largest = max(largest, p.d());
        single = single && mag(p.nParticle() - 1) < SMALL;
    }
    reduce(least, minOp<scalar>());
    reduce(largest, maxOp<scalar>());
    reduce(single, andOp<bool>());

    if (largest - least > 1e-6*largest)
    {
        FatalErrorInFunction
            << "Parcels have diameters from " << least << " to " << largest
            << " m: the force model is one of equal spheres" << exit(FatalError);
    }
    if (!single)
    {
        FatalErrorInFunction
            << "A parcel stands for another number of particles than one (nParticle):"
            << " then its neighbours are not those of a particle" << exit(FatalError);
    }
    diameter_ = largest;
}


template<class CloudType>
void Foam::NeighbourDragForce<CloudType>::gather()
{
    const label numbers = 7;
    CloudType& owner = this->owner();

    autoPtr<interpolation<vector>> Uc
    (
        interpolation<vector>::New(owner.solution().interpolationSchemes(), owner.U())
    );

    List<scalarField> parcels(Pstream::nProcs());
    scalarField& own = parcels[Pstream::myProcNo()];
    own.setSize(numbers*owner.size());
    label n = 0;
    for (const typename CloudType::parcelType& p : owner)
    {
        const vector x = position(p, this->mesh());
        const vector flow =
            Uc->interpolate(p.coordinates(), tetOf(p, this->mesh())) - p.U();
        for (direction axis = 0; axis < vector::nComponents; ++axis)
        {
            own[n + axis] = x[axis];
            own[n + 3 + axis] = flow[axis];
        }
        own[n + 6] = scalar(key(p));
        n += numbers;
    }
    Pstream::gatherList(parcels);
    Pstream::scatterList(parcels);

    label count = 0;
    for (label proci = 0; proci < parcels.size(); ++proci)
    {
        if (proci == Pstream::myProcNo())
        {
            first_ = count;
        }
        count += parcels[proci].size()/numbers;
    }
    std::vector<double> places(3*count);
    std::vector<int64_t> keys(count);
    flow_.resize(count);
    rows_.reset(count);
    label row = 0;
    for (const scalarField& values : parcels)
    {
        for (label i = 0; i < values.size(); i += numbers, ++row)
        {
            std::copy(&values[i], &values[i] + 3, &places[3*row]);
            flow_[row] = vector(values[i + 3], values[i + 4], values[i + 5]);
            keys[row] = int64_t(values[i + 6]);
            if (!rows_.insert(keys[row], row))
            {
                FatalErrorInFunction
                    << "Two parcels have the same origProc and origId, by which the drag on a"
                    << " parcel is found again on any processor" << exit(FatalError);
            }
        }
    }
    search_.reset
    (
        new dustfall::NearestNeighbours(count, places.data(), keys.data(), &period_[0])
    );
}


template<class CloudType>
Foam::vector Foam::NeighbourDragForce<CloudType>::upwards() const
{
    const vector g = this->owner().g().value();
    return mag(g) > 0 ? vector(-g/mag(g)) : vector(0, 0, 1);
}


template<class CloudType>
void Foam::NeighbourDragForce<CloudType>::evaluate()
{
    // Parcels at a time, so that what is known of them stays in the cache
    const std::size_t block = 1024;
    const std::size_t wanted = model_->neighbours();
    const label last = first_ + label(drag_.size());
    const vector rest = upwards();

    std::vector<dustfall::NearestNeighbours::Neighbour> found(wanted);
    std::vector<label> rows;
    std::vector<double> neighbours, flow, beta(block), side(3*block);
    rows.reserve(block);
    neighbours.reserve(3*wanted*block);
    flow.reserve(3*block);

    const std::vector<std::size_t>& order = search_->order();
    for (std::size_t n = 0; n < order.size(); ++n)
    {
        const label i = order[n];
        if (first_ <= i && i < last)
        {
            search_->find(i, wanted, found.data());
            for (const dustfall::NearestNeighbours::Neighbour& neighbour : found)
            {
                double separation[3];
                search_->separation(i, neighbour.point, separation);
                for (const double component : separation)
                {
                    neighbours.push_back(component/diameter_);
                }
            }
            flow.insert(flow.end(), &flow_[i][0], &flow_[i][0] + vector::nComponents);
            rows.push_back(i);
        }
        if (rows.size() == block || (n + 1 == order.size() && !rows.empty()))
        {
            predict(rows.size(), flow.data(), neighbours, rest, beta.data(), side.data());
            for (std::size_t k = 0; k < rows.size(); ++k)
            {
                drag_[rows[k] - first_] =
                    drag{beta[k], vector(side[3*k], side[3*k + 1], side[3*k + 2])};
            }
            rows.clear();
            neighbours.clear();
            flow.clear();
        }
    }
}


template<class CloudType>
const typename Foam::NeighbourDragForce<CloudType>::drag&
Foam::NeighbourDragForce<CloudType>::dragOn
(
    const typename CloudType::parcelType& p,
    const vector& flow
) const
{
    const label row = rows_.find(key(p));
    const bool known = row >= 0;
    if (first_ <= row && row < first_ + label(drag_.size()))
    {
        return drag_[row - first_];
    }
    const auto inserted = others_.emplace(key(p), drag{1, Zero});
    drag& result = inserted.first->second;
    if (!inserted.second)
    {
        return result;
    }

    // From another processor, or new
    const int wanted = model_->neighbours();
    const vector x = position(p, this->mesh());
    std::vector<dustfall::NearestNeighbours::Neighbour> found(wanted);
    const int number =
        known
      ? search_->find(row, wanted, found.data())
      : search_->find_near(&x[0], wanted, found.data());
    if (number == wanted)
    {
        std::vector<double> neighbours(3*wanted);
        for (int j = 0; j < wanted; ++j)
        {
            double* separation = &neighbours[3*j];
            if (known)
            {
                search_->separation(row, found[j].point, separation);
            }
            else
            {
                search_->separation_from(&x[0], found[j].point, separation);
            }
            for (direction axis = 0; axis < vector::nComponents; ++axis)
            {
                separation[axis] /= p.d();
            }
        }
        const vector& seen = known ? flow_[row] : flow;
        const vector rest = upwards();
        predict(1, &seen[0], neighbours, rest, &result.beta, &result.side[0]);
    }
    return result;
}


template<class CloudType>
void Foam::NeighbourDragForce<CloudType>::predict
(
    const label number,
    const scalar* flow,
    const std::vector<double>& neighbours,
    const vector& rest,
    scalar* beta,
    scalar* side
) const
{
    try
    {
        model_->drag(number, flow, neighbours.data(), &rest[0], beta, side);
    }
    catch (const std::exception& error)
    {
        FatalErrorInFunction
            << "A parcel of the cloud " << this->owner().name() << " has no drag: "
            << error.what() << exit(FatalError);
    }
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

template<class CloudType>
Foam::NeighbourDragForce<CloudType>::NeighbourDragForce
(
    CloudType& owner,
    const fvMesh& mesh,
    const dictionary& dict
)
:
    ParticleForce<CloudType>(owner, mesh, dict, typeName, true),
    fewAreIsolated_(false),
    period_(Zero),
    diameter_(0),
    first_(0)
{
    if (!owner.solution().transient())
    {
        FatalIOErrorInFunction(this->coeffs())
            << typeName << " needs a transient cloud: in a steady one the parcels of a step are"
            << " no neighbours" << exit(FatalIOError);
    }

    fileName path(this->coeffs().lookup("model"));
    path.expand();
    if (!path.isAbsolute())
    {
        // Of the whole case, also on a processor
        path = mesh.time().rootPath()/mesh.time().globalCaseName()/path;
    }
    if (!isFile(path))
    {
        FatalIOErrorInFunction(this->coeffs())
            << "There is no file " << path << ": the entry model names a force model that"
            << " dustfall exported as an OpenFOAM dictionary" << exit(FatalIOError);
    }

    const word few(this->coeffs().template lookupOrDefault<word>("fewParcels", "refuse"));
    if (few != "refuse" && few != "isolated")
    {
        FatalIOErrorInFunction(this->coeffs())
            << "fewParcels is " << few << ": refuse or isolated are allowed"
            << exit(FatalIOError);
    }
    fewAreIsolated_ = few == "isolated";

    IFstream stream(path);
    const dictionary file(stream);
    try
    {
        model_ = std::make_shared<dustfall::ForceModel>(modelDocument(file));
    }
    catch (const std::exception& error)
    {
        FatalIOErrorInFunction(file) << error.what() << exit(FatalIOError);
    }
    period_ = meshPeriod();

    Info<< "    " << typeName << ": model " << model_->name().c_str() << " with "
        << model_->neighbours() << " neighbours, SHA-256 " << model_->hash().c_str() << nl
        << "        from " << path << nl
        << "        for " << owner.name() << ", a " << static_cast<const cloud&>(owner).type()
        << ", periods " << period_ << " m" << endl;
}


template<class CloudType>
Foam::NeighbourDragForce<CloudType>::NeighbourDragForce(const NeighbourDragForce& force)
:
    ParticleForce<CloudType>(force),
    model_(force.model_),
    fewAreIsolated_(force.fewAreIsolated_),
    period_(force.period_),
    diameter_(force.diameter_),
    first_(0)
{}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

template<class CloudType>
void Foam::NeighbourDragForce<CloudType>::cacheFields(const bool store)
{
    if (!store)
    {
        return;
    }
    cpuTime timer;
    checkParcels();
    gather();
    const scalar gathered = timer.cpuTimeIncrement();

    drag_.assign(this->owner().size(), drag{1, Zero});
    others_.clear();
    const label count = search_->count();
    const label fewest = model_->neighbours() + 1;
    if (count >= fewest)
    {
        evaluate();
    }
    else if (count > 0 && !fewAreIsolated_)
    {
        FatalErrorInFunction
            << "There are " << count << " parcels: the force model needs " << fewest
            << "; with the entry fewParcels isolated, fewer feel the drag of isolated ones"
            << exit(FatalError);
    }
    if (debug)
    {
        Info<< typeName << ": " << count << " parcels, gathered and sorted in " << gathered
            << " s, neighbours and drag in " << timer.cpuTimeIncrement() << " s" << endl;
    }
}


template<class CloudType>
Foam::forceSuSp Foam::NeighbourDragForce<CloudType>::calcCoupled
(
    const typename CloudType::parcelType& p,
    const typename CloudType::parcelType::trackingData& td,
    const scalar,
    const scalar,
    const scalar,
    const scalar muc
) const
{
    const drag& felt = dragOn(p, td.Uc() - p.U());
    const scalar stokes = 3*constant::mathematical::pi*muc*p.d();
    return forceSuSp(stokes*felt.side, stokes*felt.beta);
}
