// A surface by VTK's contour filters, from an image that is 1 where a particle lives and 0 elsewhere. The filter is the
// parameter: cutproof judge ./vtk_surface.so --parameters flying_edges
// With "flying_edges_exchanged" the image is 0 where a particle lives and 1 elsewhere, and triangles are turned.
#include <cutproof/plugin.h>
#include <vtkCellArray.h>
#include <vtkDiscreteFlyingEdges3D.h>
#include <vtkDiscreteMarchingCubes.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkIdList.h>
#include <vtkImageData.h>
#include <vtkMarchingCubes.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <string>

static std::string filter_wanted;
static bool exchanged = false;

static void* create(const cutproof_host*, const char* parameters) {
  filter_wanted = parameters;
  if (const auto end = filter_wanted.find("_exchanged"); end != std::string::npos) {
    filter_wanted.resize(end);
    exchanged = true;
  }
  return &filter_wanted;
}

template <class Filter>
static vtkSmartPointer<vtkPolyData> filtered(vtkImageData* image, double value) {
  vtkNew<Filter> filter;
  filter->SetInputData(image);
  filter->SetValue(0, value);
  filter->Update();
  return filter->GetOutput();
}

static int surface(const cutproof_host* host, void*, const cutproof_tissue* tissue, const cutproof_array* alive,
                   cutproof_array* vertices, cutproof_array* triangles) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(tissue->nodes[0], tissue->nodes[1], tissue->nodes[2]);
  image->SetSpacing(tissue->spacing, tissue->spacing, tissue->spacing);
  vtkNew<vtkFloatArray> inside;
  inside->SetNumberOfTuples(image->GetNumberOfPoints());
  inside->FillValue(exchanged ? 1 : 0);
  for (int64_t i = 0; i < alive->rows; ++i) {
    int node[3];
    for (int axis = 0; axis < 3; ++axis) node[axis] = static_cast<const int32_t*>(tissue->node->data)[3 * i + axis];
    inside->SetValue(image->ComputePointId(node),
                     exchanged != (static_cast<const uint8_t*>(alive->data)[i] != 0) ? 1 : 0);
  }
  image->GetPointData()->SetScalars(inside);

  vtkSmartPointer<vtkPolyData> found;
  if (filter_wanted == "marching_cubes") found = filtered<vtkMarchingCubes>(image, 0.5);
  if (filter_wanted == "flying_edges") found = filtered<vtkFlyingEdges3D>(image, 0.5);
  if (filter_wanted == "discrete_marching_cubes") found = filtered<vtkDiscreteMarchingCubes>(image, 1);
  if (filter_wanted == "discrete_flying_edges") found = filtered<vtkDiscreteFlyingEdges3D>(image, 1);
  if (found == nullptr) return 1;

  if (host->grow(host, vertices, found->GetNumberOfPoints()) != 0) return 1;
  for (vtkIdType v = 0; v < found->GetNumberOfPoints(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      static_cast<float*>(vertices->data)[3 * v + axis] = static_cast<float>(found->GetPoint(v)[axis]);
    }
  }
  if (host->grow(host, triangles, found->GetNumberOfPolys()) != 0) return 1;
  vtkNew<vtkIdList> corners;
  for (vtkIdType t = 0; t < found->GetNumberOfPolys(); ++t) {
    found->GetPolys()->GetCellAtId(t, corners);
    for (int k = 0; k < 3; ++k) {
      static_cast<int32_t*>(triangles->data)[3 * t + k] = static_cast<int32_t>(corners->GetId(exchanged ? 2 - k : k));
    }
  }
  return 0;
}

static const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
    .name = "VTK's contour filters",
    .real = CUTPROOF_F32,
    .create = create,
    .surface = surface,
};
CUTPROOF_PLUGIN(plugin)
