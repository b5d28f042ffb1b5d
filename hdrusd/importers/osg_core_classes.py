"""The classes of OpenSceneGraph's library osg, as a binary file has them.

How a line reads: ``osg_layouts``. Names, types and versions are those of the serializers of
OpenSceneGraph 3.6.5 (file version 161), src/osgWrappers/serializers/osg. Callbacks without bases
have no serializers there: nothing follows their number.
"""

CLASSES = """
AlphaFunc(Object StateAttribute) Function:e(512=NEVER/513=LESS/514=EQUAL/515=LEQUAL/516=GREATER/
  517=NOTEQUAL/518=GEQUAL/519=ALWAYS) ReferenceValue:f
AnimationPath(Object) TimeControlPointMap:?N{=Time,d,{Position:3d,Rotation:4d,Scale:3d}}
  LoopMode:e(0=SWING/1=LOOP/2=NO_LOOPING)
AnimationPathCallback(Object NodeCallback) AnimationPath:O PivotPoint:3d UseInverseMatrix:b
  TimeOffset:d TimeMultiplier:d Pause:b
Array(Object BufferData@147-) Binding:e(-1=BIND_UNDEFINED/0=BIND_OFF/1=BIND_OVERALL/
  2=BIND_PER_PRIMITIVE_SET/3=BIND_PER_PRIMITIVE/4=BIND_PER_VERTEX) Normalize:-b
  PreserveDataType:-b
AtomicCounterBufferBinding(Object StateAttribute BufferIndexBinding)
AudioSink(Object)
AudioStream(Object)
AutoTransform(Object Node Group Transform) MinimumScale:d MaximumScale:d Position:3d Scale:3d
  PivotPoint:3d AutoUpdateEyeMovementTolerance:f AutoRotateMode:e(0=NO_ROTATION/
  1=ROTATE_TO_SCREEN/2=ROTATE_TO_CAMERA) AutoScaleToScreen:b Rotation:4d
  AutoScaleTransitionWidthRatio:f
Billboard(Object Node Geode) Mode:i Axis:3f Normal:3f PositionList:?n{3d}
BindImageTexture(Object StateAttribute) Texture:O ImageUnit:I Level:i IsLayered:b Layer:i
  Access:i Format:g
BlendColor(Object StateAttribute) ConstantColor:4f
BlendEquation(Object StateAttribute) EquationRGB:i EquationAlpha:i
BlendEquationi(Object StateAttribute BlendEquation) Index:I
BlendFunc(Object StateAttribute) SourceRGB:g SourceAlpha:g DestinationRGB:g DestinationAlpha:g
BlendFunci(Object StateAttribute BlendFunc) Index:I
BoolValueObject(Object) Value:b
Box(Object Shape) Center:3f HalfLengths:3f Rotation:4d
BufferData(Object) BufferObject@147-:-O
BufferIndexBinding(Object StateAttribute) Target:g BufferData:O Index:I Size:?! Offset:?!
BufferObject(Object) Target:g Usage:g CopyDataAndReleaseGLBufferObject:b
ByteArray(Object BufferData@147- Array) vector:[c]
Callback(Object) NestedCallback:O
CallbackObject(Object Callback)
Camera(Object Node Group Transform) AllowEventFocus:b ClearMask@-122:?i ClearMask@123-:i
  ClearColor:4f ClearAccum:4f ClearDepth:d ClearStencil:i ColorMask:O Viewport:O TransformOrder:i
  ProjectionResizePolicy:i ProjectionMatrix:M ViewMatrix:M RenderOrder:?2i DrawBuffer:g
  ReadBuffer:g RenderTargetImplementation:i BufferAttachmentMap:?! InitialDrawCallback:O
  PreDrawCallback:O PostDrawCallback:O FinalDrawCallback:O
  InheritanceMaskActionOnAttributeSetting@123-:i InheritanceMask@123-:i
  ImplicitBufferAttachmentRenderMask@140-:i ImplicitBufferAttachmentResolveMask@140-:i
CameraView(Object Node Group Transform) Position:3d Attitude:4d FieldOfView:d
  FieldOfViewMode:e(0=UNCONSTRAINED/1=HORIZONTAL/2=VERTICAL) FocalLength:d
Capsule(Object Shape) Center:3f Radius:f Height:f Rotation:4d
CharValueObject(Object) Value:c
ClampColor(Object StateAttribute) ClampVertexColor:g ClampFragmentColor:g ClampReadColor:g
ClearNode(Object Node Group) RequiresClear:b ClearColor:4f ClearMask@-122:?i ClearMask@123-:i
ClipControl(Object StateAttribute) Origin:i DepthMode:i
ClipNode(Object Node Group) ClipPlaneList:[o] ReferenceFrame:i
ClipPlane(Object StateAttribute) ClipPlane:4d ClipPlaneNum:I
ClusterCullingCallback(Object Callback NodeCallback) ControlPoint:3f Normal:3f Radius:f
  Deviation:f
ColorMask(Object StateAttribute) RedMask:b GreenMask:b BlueMask:b AlphaMask:b
ColorMaski(Object StateAttribute ColorMask) Index:I
ColorMatrix(Object StateAttribute) Matrix:M
CompositeShape(Object Shape) Shape:O Children:?n{o}
ComputeBoundingBoxCallback(Object)
ComputeBoundingSphereCallback(Object)
Cone(Object Shape) Center:3f Radius:f Height:f Rotation:4d
ConvexHull(Object Shape TriangleMesh)
ConvexPlanarOccluder(Object) Occluder:?n{3d} Holes:?n{=Polygon,n{3d}}
CoordinateSystemNode(Object Node Group) Format:s CoordinateSystem:s EllipsoidModel:O
CullFace(Object StateAttribute) Mode:e(1028=FRONT/1029=BACK/1032=FRONT_AND_BACK)
Cylinder(Object Shape) Center:3f Radius:f Height:f Rotation:4d
DefaultIndirectCommandDrawArrays(Object BufferData@147- IndirectCommandDrawArrays) DACommands:?!
DefaultIndirectCommandDrawElements(Object BufferData@147- IndirectCommandDrawElements)
  DECommands:?!
DefaultUserDataContainer(Object UserDataContainer) UDC_UserData:?{o} UDC_Descriptions:?n{s}
  UDC_UserObjects:?n{o}
Depth(Object StateAttribute) Function:i ZNear:d ZFar:d WriteMask:b
DispatchCompute(Object Node@154- Drawable) ComputeGroups:?3i
DoubleArray(Object BufferData@147- Array) vector:[d]
DoubleValueObject(Object) Value:d
DrawArrayLengths(Object BufferData@147- PrimitiveSet) First:i vector:[i]
DrawArrays(Object BufferData@147- PrimitiveSet) First:i Count:i
DrawArraysIndirect(Object BufferData@147- PrimitiveSet) IndirectCommandArray:O
  FirstCommandToDraw:I Stride:i
DrawElementsIndirect(Object BufferData@147- PrimitiveSet) IndirectCommandArray:O
  FirstCommandToDraw:I Stride:i
DrawElementsIndirectUByte(Object BufferData@147- PrimitiveSet DrawElementsIndirect) vector:[C]
DrawElementsIndirectUInt(Object BufferData@147- PrimitiveSet DrawElementsIndirect) vector:[I]
DrawElementsIndirectUShort(Object BufferData@147- PrimitiveSet DrawElementsIndirect) vector:[H]
DrawElementsUByte(Object BufferData@147- PrimitiveSet) vector:[C]
DrawElementsUInt(Object BufferData@147- PrimitiveSet) vector:[I]
DrawElementsUShort(Object BufferData@147- PrimitiveSet) vector:[H]
DrawIndirectBufferObject(Object BufferObject)
DrawPixels(Object Node@154- Drawable) Position:3f Image:Y UseSubImage:b Area:?4I
Drawable(Object Node@154-) StateSet@-155:O InitialBound:?{Minimum:3d,Maximum:3d}
  ComputeBoundingBoxCallback:O Shape:O SupportsDisplayList:-b UseDisplayList:-b
  UseVertexBufferObjects:-b UpdateCallback@-155:O EventCallback@-155:O CullCallback@-155:O
  DrawCallback@-155:O NodeMask@142-:I CullingActive@145-:-b
DrawableCullCallback()
DrawableEventCallback()
DrawableUpdateCallback()
ElementBufferObject(Object BufferObject)
EllipsoidModel(Object) RadiusEquator:d RadiusPolar:d
FloatArray(Object BufferData@147- Array) vector:[f]
FloatValueObject(Object) Value:f
Fog(Object StateAttribute) Mode:i Start:f End:f Density:f Color:4f FogCoordinateSource:g
  UseRadialFog:b
FragmentProgram(Object StateAttribute) FragmentProgram:s LocalParameters:?n{I,4d}
  Matrices:?n{I,M}
FrontFace(Object StateAttribute) Mode:e(2304=CLOCKWISE/2305=COUNTER_CLOCKWISE)
Geode(Object Node) Drawables:?n{o}
Geometry(Object Node@154- Drawable) PrimitiveSetList@-111:[p] PrimitiveSetList@112-:[o]
  VertexData@-111:?V NormalData@-111:?V ColorData@-111:?V SecondaryColorData@-111:?V
  FogCoordData@-111:?V TexCoordData@-111:?n{=Data,V} VertexAttribData@-111:?n{=Data,V}
  FastPathHint@-111:? VertexArray@112-:O NormalArray@112-:O ColorArray@112-:O
  SecondaryColorArray@112-:O FogCoordArray@112-:O TexCoordArrayList@112-:[o]
  VertexAttribArrayList@112-:[o]
Group(Object Node) Children:?n{o}
HeightField(Object Shape) Area:?2I Origin:3f XInterval:f YInterval:f SkirtHeight:f BorderWidth:I
  Rotation:4d Heights:?A
Hint(Object StateAttribute) Target:g Mode:g
Image(Object BufferData@154-) FileName@112-:s WriteHint@112-:i AllocationMode@112-:i
  InternalTextureFormat@112-:g DataType@112-:g PixelFormat@112-:g RowLength@112-:i Packing@112-:I
  Origin@112-:i
ImageSequence(Object BufferData@154- Image ImageStream) ReferenceTime:d TimeMultiplier:d Mode:i
  Length:d FileNames:?n{s} Images:?n{o}
ImageStream(Object BufferData@154- Image) LoopingMode:i AudioStreams:[o]
IndirectCommandDrawArrays(Object BufferData@147-)
IndirectCommandDrawElements(Object BufferData@147-)
IntArray(Object BufferData@147- Array) vector:[i]
IntValueObject(Object) Value:i
LOD(Object Node Group) CenterMode:i UserCenter:?4d RangeMode:e(0=DISTANCE_FROM_EYE_POINT/
  1=PIXEL_SIZE_ON_SCREEN) RangeList:?n{2f}
Light(Object StateAttribute) LightNum:i Ambient:4f Diffuse:4f Specular:4f Position:4f
  Direction:3f ConstantAttenuation:f LinearAttenuation:f QuadraticAttenuation:f SpotExponent:f
  SpotCutoff:f
LightModel(Object StateAttribute) AmbientIntensity:4f ColorControl:e(0=SEPARATE_SPECULAR_COLOR/
  1=SINGLE_COLOR) LocalViewer:b TwoSided:b
LightSource(Object Node Group) Light:O ReferenceFrame:e(0=RELATIVE_RF/1=ABSOLUTE_RF)
LineStipple(Object StateAttribute) Factor:i Pattern:H
LineWidth(Object StateAttribute) Width:f
LogicOp(Object StateAttribute) Opcode:i
Material(Object StateAttribute) ColorMode:e(4608=AMBIENT/4609=DIFFUSE/4610=SPECULAR/
  5632=EMISSION/5634=AMBIENT_AND_DIFFUSE/5635=OFF) Ambient:?b,=Front,4f,=Back,4f
  Diffuse:?b,=Front,4f,=Back,4f Specular:?b,=Front,4f,=Back,4f Emission:?b,=Front,4f,=Back,4f
  Shininess:?b,=Front,f,=Back,f
MatrixTransform(Object Node Group Transform) Matrix:M
MatrixdValueObject(Object) Value:M
MatrixfValueObject(Object) Value:M
MultiDrawArrays(Object BufferData@147- PrimitiveSet) Firsts:[i] Counts:[i]
MultiDrawArraysIndirect(Object BufferData@147- PrimitiveSet DrawArraysIndirect)
  NumCommandsToDraw:I
MultiDrawElementsIndirectUByte(Object BufferData@147- PrimitiveSet DrawElementsIndirect
  DrawElementsIndirectUByte) NumCommandsToDraw:I
MultiDrawElementsIndirectUInt(Object BufferData@147- PrimitiveSet DrawElementsIndirect
  DrawElementsIndirectUInt) NumCommandsToDraw:I
MultiDrawElementsIndirectUShort(Object BufferData@147- PrimitiveSet DrawElementsIndirect
  DrawElementsIndirectUShort) NumCommandsToDraw:I
Multisample(Object StateAttribute) Coverage:f Invert:b Hint:i
Node(Object) InitialBound:?{Center:3d,Radius:d} ComputeBoundingSphereCallback:O UpdateCallback:O
  EventCallback:O CullCallback:O CullingActive:-b NodeMask:I Descriptions@-76:?n{s} StateSet:O
NodeCallback(Object Callback)
NodeTrackerCallback(Object NodeCallback) TrackNode:O
NodeVisitor(Object) TraversalMode:i VisitorType:i TraversalMask:I TraversalNumber:I
Object() Name:s DataVariance:-i UserData@-76:?{o} UserDataContainer@77-:O
OccluderNode(Object Node Group) Occluder:O
OcclusionQueryNode(Object Node Group) QueriesEnabled:b VisibilityThreshold:I QueryFrameCount:I
  DebugDisplay:b
PagedLOD(Object Node LOD) DatabasePath:?t FrameNumberOfLastTraversal@-69:I
  NumChildrenThatCannotBeExpired:I DisableExternalChildrenPaging:b
  RangeDataList:?n{s},PriorityList:n{2f} Children:?n{o}
PatchParameter(Object StateAttribute) Vertices:i PatchDefaultInnerLevel:2f
  PatchDefaultOuterLevel:4f
PlaneValueObject(Object) Value:4d
Point(Object StateAttribute) Size:f FadeThresholdSize:f DistanceAttenuation:3f MinSize:f
  MaxSize:f
PointSprite(Object StateAttribute) CoordOriginMode:i
PolygonMode(Object StateAttribute) Mode:?b,=Front,g,=Back,g
PolygonOffset(Object StateAttribute) Factor:f Units:f
PolygonStipple(Object StateAttribute) Mask:?r
PositionAttitudeTransform(Object Node Group Transform) Position:3d Attitude:4d Scale:3d
  PivotPoint:3d
PrimitiveRestartIndex(Object StateAttribute) RestartIndex:?I
PrimitiveSet(Object BufferData@147-) NumInstances:-i Mode:e(0=POINTS/1=LINES/2=LINE_LOOP/
  3=LINE_STRIP/4=TRIANGLES/5=TRIANGLE_STRIP/6=TRIANGLE_FAN/7=QUADS/8=QUAD_STRIP/9=POLYGON/
  10=LINES_ADJACENCY/11=LINE_STRIP_ADJACENCY/12=TRIANGLES_ADJACENCY/13=TRIANGLE_STRIP_ADJACENCY/
  14=PATCHES)
Program(Object StateAttribute) AttribBinding:?n{s,I} FragDataBinding:?n{s,I} Shaders:?n{o}
  GeometryVerticesOut:?i GeometryInputType:?i GeometryOutputType:?i ComputeGroups@95-152:?3i
  FeedBackVaryingsName@116-:?n{s} FeedBackMode@116-:?I BindUniformBlock@150-:?n{s,I}
Projection(Object Node Group) Matrix:M
ProxyNode(Object Node) FileNames:?n{s} Children:?n{o} DatabasePath:s
  LoadingExternalReferenceMode:i CenterMode:i UserCenter:?4d
QuatValueObject(Object) Value:4d
SampleMaski(Object StateAttribute) Masks:?!
Scissor(Object StateAttribute) Area:?4i
Script(Object) Script:s Language:s
ScriptNodeCallback(Object Callback CallbackObject) Script:O EntryPoint:s
Sequence(Object Node Group) TimeList:[d] LoopMode:i Begin:i End:i Speed:f NumRepeats:i
  DefaultTime:d LastFrameTime:d Mode:i Sync:b ClearOnStop:b
ShadeModel(Object StateAttribute) Mode:i
Shader(Object) Type:i ShaderSource:?n{s} ShaderBinary:O
ShaderAttribute(Object StateAttribute)
ShaderBinary(Object) Data:?r
ShaderStorageBufferBinding(Object StateAttribute BufferIndexBinding)
Shape(Object)
ShapeDrawable(Object Node@154- Drawable) Color:4f TessellationHints:O
ShortArray(Object BufferData@147- Array) vector:[h]
ShortValueObject(Object) Value:h
Sphere(Object Shape) Center:3f Radius:f
StateAttribute(Object) UpdateCallback:O EventCallback:O
StateAttributeCallback()
StateSet(Object) ModeList:?N{g,v} AttributeList:?N{o,Value:v} TextureModeList:?n{=Data,N{g,v}}
  TextureAttributeList:?n{=Data,N{o,Value:v}} UniformList:?n{o,Value:v} RenderingHint:i
  RenderBinMode:-i BinNumber:-i BinName:s NestRenderBins:-b UpdateCallback:O EventCallback:O
  DefineList@151-:?n{s,s,Value:v}
Stencil(Object StateAttribute) Function:i FunctionRef:i FunctionMask:I StencilFailOperation:i
  StencilPassAndDepthFailOperation:i StencilPassAndDepthPassOperation:i WriteMask:I
StencilTwoSided(Object StateAttribute) Function:?=Front,i,=Back,i FunctionRef:?=Front,i,=Back,i
  FunctionMask:?=Front,i,=Back,i StencilFailOperation:?=Front,i,=Back,i
  StencilPassAndDepthFailOperation:?=Front,i,=Back,i
  StencilPassAndDepthPassOperation:?=Front,i,=Back,i WriteMask:?=Front,i,=Back,i
StringValueObject(Object) Value:s
Switch(Object Node Group) NewChildDefaultValue:b ValueList:[b]
TessellationHints(Object) TessellationMode:i DetailRatio:f TargetNumFaces:I CreateFrontFace:b
  CreateBackFace:b CreateNormals:b CreateTextureCoords:b CreateTop:b CreateBody:b CreateBottom:b
TexEnv(Object StateAttribute) Mode:e(260=ADD/3042=BLEND/7681=REPLACE/8448=MODULATE/8449=DECAL)
  Color:4f
TexEnvCombine(Object StateAttribute) Combine_RGB:g Combine_Alpha:g Source0_RGB:g Source1_RGB:g
  Source2_RGB:g Source0_Alpha:g Source1_Alpha:g Source2_Alpha:g Operand0_RGB:g Operand1_RGB:g
  Operand2_RGB:g Operand0_Alpha:g Operand1_Alpha:g Operand2_Alpha:g Scale_RGB:f Scale_Alpha:f
  ConstantColor:4f
TexEnvFilter(Object StateAttribute) LodBias:f
TexGen(Object StateAttribute) Mode:i PlaneS:?4d PlaneT:?4d PlaneR:?4d PlaneQ:?4d
TexGenNode(Object Node Group) TextureUnit:I TexGen:O ReferenceFrame:i
TexMat(Object StateAttribute) Matrix:M ScaleByTextureRectangleSize:-b
Texture(Object StateAttribute) WRAP_S:?g WRAP_T:?g WRAP_R:?g MIN_FILTER:?g MAG_FILTER:?g
  MaxAnisotropy:-f UseHardwareMipMapGeneration:-b UnRefImageDataAfterApply:-b
  ClientStorageHint:-b ResizeNonPowerOfTwoHint:-b BorderColor:-4d BorderWidth:-i
  InternalFormatMode:-i InternalFormat:?g SourceFormat:?g SourceType:?g ShadowComparison:-b
  ShadowCompareFunc:-i ShadowTextureMode:-i ShadowAmbient:-f ImageAttachment@95-153:?I,i,C,i,I,I
  Swizzle@98-:?s MinLOD@155-:-f MaxLOD@155-:-f LODBias@155-:-f
Texture1D(Object StateAttribute Texture) Image:Y TextureWidth:i
Texture2D(Object StateAttribute Texture) Image:Y TextureWidth:-i TextureHeight:-i
Texture2DArray(Object StateAttribute Texture) Images:?n{m} TextureWidth:i TextureHeight:i
  TextureDepth:i
Texture2DMultisample(Object StateAttribute Texture) TextureWidth:i TextureHeight:i NumSamples:i
  FixedSampleLocations:C
Texture3D(Object StateAttribute Texture) Image:Y TextureWidth:i TextureHeight:i TextureDepth:i
TextureBuffer(Object StateAttribute Texture) TextureWidth:i BufferData:O
TextureCubeMap(Object StateAttribute Texture) PosX:?Z NegX:?Z PosY:?Z NegY:?Z PosZ:?Z NegZ:?Z
  TextureWidth:i TextureHeight:i
TextureRectangle(Object StateAttribute Texture) Image:Y TextureWidth:i TextureHeight:i
TransferFunction(Object)
TransferFunction1D(Object TransferFunction) ColorMap:[f,4f]
Transform(Object Node Group) ReferenceFrame:e(0=RELATIVE_RF/1=ABSOLUTE_RF/
  2=ABSOLUTE_RF_INHERIT_VIEWPOINT)
TransformFeedbackBufferBinding(Object StateAttribute BufferIndexBinding)
TriangleMesh(Object Shape) Vertices:?! Indices:?!
UByteArray(Object BufferData@147- Array) vector:[C]
UCharValueObject(Object) Value:C
UIntArray(Object BufferData@147- Array) vector:[I]
UIntValueObject(Object) Value:I
UShortArray(Object BufferData@147- Array) vector:[H]
UShortValueObject(Object) Value:H
Uniform(Object) Type:i NumElements:I Elements:?a UpdateCallback:O EventCallback:O
UniformBufferBinding(Object StateAttribute BufferIndexBinding)
UniformCallback(Object Callback)
UpdateCallback(Object Callback)
UserDataContainer(Object)
Vec2Array(Object BufferData@147- Array) vector:[2f]
Vec2bArray(Object BufferData@147- Array) vector:[2c]
Vec2dArray(Object BufferData@147- Array) vector:[2d]
Vec2dValueObject(Object) Value:2d
Vec2fValueObject(Object) Value:2f
Vec2iArray(Object BufferData@147- Array) vector:[2i]
Vec2sArray(Object BufferData@147- Array) vector:[2h]
Vec2ubArray(Object BufferData@147- Array) vector:[2C]
Vec2uiArray(Object BufferData@147- Array) vector:[2I]
Vec2usArray(Object BufferData@147- Array) vector:[2H]
Vec3Array(Object BufferData@147- Array) vector:[3f]
Vec3bArray(Object BufferData@147- Array) vector:[3c]
Vec3dArray(Object BufferData@147- Array) vector:[3d]
Vec3dValueObject(Object) Value:3d
Vec3fValueObject(Object) Value:3f
Vec3iArray(Object BufferData@147- Array) vector:[3i]
Vec3sArray(Object BufferData@147- Array) vector:[3h]
Vec3ubArray(Object BufferData@147- Array) vector:[3C]
Vec3uiArray(Object BufferData@147- Array) vector:[3I]
Vec3usArray(Object BufferData@147- Array) vector:[3H]
Vec4Array(Object BufferData@147- Array) vector:[4f]
Vec4bArray(Object BufferData@147- Array) vector:[4c]
Vec4dArray(Object BufferData@147- Array) vector:[4d]
Vec4dValueObject(Object) Value:4d
Vec4fValueObject(Object) Value:4f
Vec4iArray(Object BufferData@147- Array) vector:[4i]
Vec4sArray(Object BufferData@147- Array) vector:[4h]
Vec4ubArray(Object BufferData@147- Array) vector:[4C]
Vec4uiArray(Object BufferData@147- Array) vector:[4I]
Vec4usArray(Object BufferData@147- Array) vector:[4H]
VertexAttribDivisor(Object StateAttribute) Index:I Divisor:I
VertexBufferObject(Object BufferObject)
VertexProgram(Object StateAttribute) VertexProgram:s LocalParameters:?n{I,4d} Matrices:?n{I,M}
Viewport(Object StateAttribute) Area:?4d
"""
