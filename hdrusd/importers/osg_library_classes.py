"""The classes of OpenSceneGraph's further libraries, as a binary file has them.

How a line reads: ``osg_layouts``. Names, types and versions are those of the serializers of
OpenSceneGraph 3.6.5 (file version 161), src/osgWrappers/serializers/osgSim and its neighbours.
"""

CLASSES = """
osgSim::AzimElevationSector(Object osgSim::Sector) AzimRange:?3f ElevationRange:?3f
osgSim::AzimSector(Object osgSim::Sector) AzimRange:?3f
osgSim::BlinkSequence(Object) PhaseShift:d PulseData:?n{d,4f} SequenceGroup:O
osgSim::ConeSector(Object osgSim::Sector) Axis:3f Angle:?2f
osgSim::DOFTransform(Object Node Group Transform) MinHPR:3f MaxHPR:3f CurrentHPR:3f
  IncrementHPR:3f MinTranslate:3f MaxTranslate:3f CurrentTranslate:3f IncrementTranslate:3f
  MinScale:3f MaxScale:3f CurrentScale:3f IncrementScale:3f PutMatrix:?M LimitationFlags:?I
  AnimationOn:b HPRMultOrder:e(0=PRH/1=PHR/2=HPR/3=HRP/4=RPH/5=RHP)
osgSim::DirectionalSector(Object osgSim::Sector) Direction:3f LobeRollAngle:f HorizLobeAngle:f
  VertLobeAngle:f FadeAngle:f
osgSim::ElevationSector(Object osgSim::Sector) ElevationRange:?3f
osgSim::Impostor(Object Node Group LOD) ImpostorThreshold:f
osgSim::LightPointNode(Object Node)
  LightPointList:?n{=LightPoint,{Position:3f,Color:4f,Attributes:b,i,2f,Sector:X,BlinkSequence:X}}
  MinPixelSize:f MaxPixelSize:f MaxVisibleDistance2:f LightPointSystem:O PointSprite:b
osgSim::LightPointSystem(Object) Intensity:f AnimationState:i
osgSim::MultiSwitch(Object Node Group) NewChildDefaultValue:b ActiveSwitchSet:I
  Values:?n{=SwitchSet,n{b}}
osgSim::ObjectRecordData(Object) Data:?I,h,H,3h
osgSim::OverlayNode(Object Node Group) OverlayTechnique:i OverlaySubgraph:O TexEnvMode:g
  OverlayTextureUnit:I OverlayTextureSizeHint:I OverlayClearColor:4f ContinuousUpdate:b
  OverlayBaseHeight:d
osgSim::ScalarBar(Object Node Geode) NumColors:i NumLabels:i ScalarsToColors:?! Title:s
  Position:3f Width:f AspectRatio:f Orientation:i ScalarPrinter:?! TextProperties:?!
osgSim::Sector(Object)
osgSim::SequenceGroup(Object) BaseTime:d
osgSim::ShapeAttributeList(Object) Attributes:?!
osgSim::SphereSegment(Object Node Geode) Centre:3f Radius:f Area:?! Density:i DrawMask:i
  SurfaceColor:4f SpokeColor:4f EdgeLineColor:4f SideColor:4f
osgSim::VisibilityGroup(Object Node Group) VisibilityVolume:O VolumeIntersectionMask:I
  SegmentLength:f
osgAnimation::Action(Object) NumFrames:I Loop:I
osgAnimation::ActionAnimation(Object osgAnimation::Action)
osgAnimation::ActionBlendIn(Object osgAnimation::Action)
osgAnimation::ActionBlendOut(Object osgAnimation::Action)
osgAnimation::ActionStripAnimation(Object osgAnimation::Action)
osgAnimation::Animation(Object) Duration:d Weight:f StartTime:d PlayMode:i Channels:?n{=Type,K}
osgAnimation::AnimationManagerBase(Object NodeCallback) Animations:?n{o} AutomaticLink:b
osgAnimation::BasicAnimationManager(Object NodeCallback osgAnimation::AnimationManagerBase)
osgAnimation::Bone(Object Node Group Transform MatrixTransform) InvBindMatrixInSkeletonSpace:M
  MatrixInSkeletonSpace:M
osgAnimation::MorphGeometry(Object Node@154- Drawable Geometry) Method:i MorphTargets:?n{f,o}
  MorphNormals:b VertexData:?! NormalData:?! MorphTransformImplementation@147-:O
osgAnimation::MorphTransform(Object)
osgAnimation::MorphTransformHardware(Object osgAnimation::MorphTransform) Shader@152-:O
  ReservedTextureUnit@152-:I
osgAnimation::MorphTransformSoftware(Object osgAnimation::MorphTransform)
osgAnimation::RigComputeBoundingBoxCallback(Object ComputeBoundingBoxCallback)
osgAnimation::RigGeometry(Object Node@154- Drawable Geometry) InfluenceMap:?n{s,n{i,f}}
  SourceGeometry:O RigTransformImplementation@145-:O
osgAnimation::RigTransform(Object)
osgAnimation::RigTransformHardware(Object osgAnimation::RigTransform) Shader@152-:O
  FirstVertexAttributeTarget@152-:I
osgAnimation::RigTransformSoftware(Object osgAnimation::RigTransform)
osgAnimation::Skeleton(Object Node Group Transform MatrixTransform)
osgAnimation::StackedMatrixElement(Object osgAnimation::StackedTransformElement) Matrix:M
osgAnimation::StackedQuaternionElement(Object osgAnimation::StackedTransformElement)
  Quaternion:4d
osgAnimation::StackedRotateAxisElement(Object osgAnimation::StackedTransformElement) Axis:3f
  Angle:d
osgAnimation::StackedScaleElement(Object osgAnimation::StackedTransformElement) Scale:3f
osgAnimation::StackedTransformElement(Object)
osgAnimation::StackedTranslateElement(Object osgAnimation::StackedTransformElement) Translate:3f
osgAnimation::Timeline(Object osgAnimation::Action)
osgAnimation::TimelineAnimationManager(Object NodeCallback osgAnimation::AnimationManagerBase)
osgAnimation::UpdateBone(Object Callback NodeCallback osgAnimation::UpdateMatrixTransform)
osgAnimation::UpdateFloatUniform(Object Callback UniformCallback)
osgAnimation::UpdateMaterial(Object Callback)
osgAnimation::UpdateMatrixTransform(Object Callback NodeCallback) StackedTransforms:?n{o}
osgAnimation::UpdateMatrixfUniform(Object Callback UniformCallback)
osgAnimation::UpdateMorph(Object Callback NodeCallback) TargetNames:[s]
osgAnimation::UpdateMorphGeometry(Object Callback UpdateCallback)
osgAnimation::UpdateRigGeometry(Object Callback UpdateCallback)
osgAnimation::UpdateSkeleton(Object Callback NodeCallback)
osgAnimation::UpdateVec2fUniform(Object Callback UniformCallback)
osgAnimation::UpdateVec3fUniform(Object Callback UniformCallback)
osgAnimation::UpdateVec4fUniform(Object Callback UniformCallback)
osgFX::AnisotropicLighting(Object Node Group osgFX::Effect) LightNumber:i LightingMap:?!
osgFX::BumpMapping(Object Node Group osgFX::Effect) LightNumber:i DiffuseTextureUnit:i
  NormalMapTextureUnit:i OverrideDiffuseTexture:O OverrideNormalMapTexture:O
osgFX::Cartoon(Object Node Group osgFX::Effect) OutlineColor:4f OutlineLineWidth:f LightNumber:i
osgFX::Effect(Object Node Group) Enabled:b SelectedTechnique:?i
osgFX::MultiTextureControl(Object Node Group) TextureWeights@-115:?n{f} TextureWeights@116-:O
  UseTexEnvCombine@116-:b UseTextureWeightsUniform@116-:b
osgFX::Outline(Object Node Group osgFX::Effect) Width:f Color:4f
osgFX::Scribe(Object Node Group osgFX::Effect) WireframeColor:4f WireframeLineWidth:f
osgFX::SpecularHighlights(Object Node Group osgFX::Effect) LightNumber:i TextureUnit:i
  SpecularColor:4f SpecularExponent:f
osgShadow::DebugShadowMap(Object osgShadow::ShadowTechnique
  osgShadow::ViewDependentShadowTechnique) DebugDraw:b
osgShadow::LightSpacePerspectiveShadowMapCB(Object osgShadow::ShadowTechnique
  osgShadow::ViewDependentShadowTechnique osgShadow::DebugShadowMap osgShadow::StandardShadowMap
  osgShadow::MinimalShadowMap osgShadow::MinimalCullBoundsShadowMap)
osgShadow::LightSpacePerspectiveShadowMapDB(Object osgShadow::ShadowTechnique
  osgShadow::ViewDependentShadowTechnique osgShadow::DebugShadowMap osgShadow::StandardShadowMap
  osgShadow::MinimalShadowMap osgShadow::MinimalDrawBoundsShadowMap)
osgShadow::LightSpacePerspectiveShadowMapVB(Object osgShadow::ShadowTechnique
  osgShadow::ViewDependentShadowTechnique osgShadow::DebugShadowMap osgShadow::StandardShadowMap
  osgShadow::MinimalShadowMap)
osgShadow::MinimalCullBoundsShadowMap(Object osgShadow::ShadowTechnique
  osgShadow::ViewDependentShadowTechnique osgShadow::DebugShadowMap osgShadow::StandardShadowMap
  osgShadow::MinimalShadowMap)
osgShadow::MinimalDrawBoundsShadowMap(Object osgShadow::ShadowTechnique
  osgShadow::ViewDependentShadowTechnique osgShadow::DebugShadowMap osgShadow::StandardShadowMap
  osgShadow::MinimalShadowMap)
osgShadow::MinimalShadowMap(Object osgShadow::ShadowTechnique
  osgShadow::ViewDependentShadowTechnique osgShadow::DebugShadowMap osgShadow::StandardShadowMap)
  ModellingSpaceToWorldTransform:M MaxFarPlane:f MinLightMargin:f
  ShadowReceivingCoarseBoundAccuracy:i
osgShadow::ParallelSplitShadowMap(Object osgShadow::ShadowTechnique) PolygonOffset:2f
  TextureResolution:I MaxFarDistance:d MoveVCamBehindRCamFactor:d MinNearDistanceForSplits:d
  UserLight:O AmbientBias:2f SplitCalculationMode:i
osgShadow::ShadowMap(Object osgShadow::ShadowTechnique) TextureUnit:I PolygonOffset:2f
  AmbientBias:2f TextureSize:2h
osgShadow::ShadowTechnique(Object)
osgShadow::ShadowTexture(Object osgShadow::ShadowTechnique) TextureUnit:I
osgShadow::ShadowVolume(Object osgShadow::ShadowTechnique) DrawMode:i DynamicShadowVolumes:b
osgShadow::ShadowedScene(Object Node Group) ReceivesShadowTraversalMask:I
  CastsShadowTraversalMask:I ShadowTechnique:O
osgShadow::SoftShadowMap(Object osgShadow::ShadowTechnique osgShadow::ShadowMap) SoftnessWidth:f
  JitteringScale:f JitterTextureUnit:I Bias:f
osgShadow::StandardShadowMap(Object osgShadow::ShadowTechnique
  osgShadow::ViewDependentShadowTechnique osgShadow::DebugShadowMap) BaseTextureUnit:I
  ShadowTextureUnit:I BaseTextureCoordIndex:I ShadowTextureCoordIndex:I TextureSize:2h Light:O
osgShadow::ViewDependentShadowTechnique(Object osgShadow::ShadowTechnique)
osgTerrain::CompositeLayer(Object osgTerrain::Layer) Layers:?!
osgTerrain::ContourLayer(Object osgTerrain::Layer) TransferFunction:O
osgTerrain::DisplacementMappingTechnique(Object osgTerrain::TerrainTechnique)
osgTerrain::GeometryTechnique(Object osgTerrain::TerrainTechnique) FilterBias:f FilterWidth:f
  FilterMatrix:?!
osgTerrain::HeightFieldLayer(Object osgTerrain::Layer) HeightField:O
osgTerrain::ImageLayer(Object osgTerrain::Layer) Image:?!
osgTerrain::Layer(Object) FileName:s Locator:O MinLevel:I MaxLevel:I ValidDataOperator:?!
  DefaultValue:4f MinFilter:g MagFilter:g
osgTerrain::Locator(Object) CoordinateSystemType:i Format:s CoordinateSystem:s EllipsoidModel:O
  Transform:M DefinedInFile:b TransformScaledByResolution:b
osgTerrain::ProxyLayer(Object osgTerrain::Layer) Implementation:O
osgTerrain::SwitchLayer(Object osgTerrain::Layer osgTerrain::CompositeLayer) ActiveLayer:i
osgTerrain::Terrain(Object Node Group CoordinateSystemNode) SampleRatio:f VerticalScale:f
  BlendingPolicy:i
osgTerrain::TerrainTechnique(Object)
osgTerrain::TerrainTile(Object Node Group) TileID:?! TerrainTechnique:O Locator:O
  ElevationLayer:O ColorLayers:?! RequiresNormals:b TreatBoundariesToValidDataAsDefaultValue:b
  BlendingPolicy:i
osgText::FadeText(Object Node@154- Drawable osgText::TextBase osgText::Text) FadeSpeed:f
osgText::Text(Object Node@154- Drawable osgText::TextBase) Color:4f BackdropType:i
  BackdropImplementation:i BackdropOffset:?2f BackdropColor:4f ColorGradientMode:i
  ColorGradientCorners:?{16d}
osgText::Text3D(Object Node@154- Drawable osgText::TextBase) CharacterDepth:f RenderMode:i
  Color@68-:4f
osgText::TextBase(Object Node@154- Drawable) Font:?s FontSize:?2I CharacterSize:?2f
  CharacterSizeMode:i MaximumWidth:f MaximumHeight:f LineSpacing:f Text:?T Position:3f
  Alignment:i AxisAlignment:i Rotation:4d AutoRotateToScreen:b Layout:i DrawMode@-122:?i
  DrawMode@123-:i BoundingBoxMargin:f BoundingBoxColor:4f
"""
